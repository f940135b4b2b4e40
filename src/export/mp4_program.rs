//! One run of an outside program, its messages collected so that an error can quote them.

use std::collections::VecDeque;
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, Command, ExitStatus, Stdio};
use std::thread::{self, JoinHandle};

use super::ExportError;

/// How many of the last messages an error quotes.
const LAST_LINES: usize = 6;

/// A running program; killed when dropped.
#[derive(Debug)]
pub(super) struct Program {
    name: PathBuf,
    destination: PathBuf,
    child: Child,
    stdin: Option<ChildStdin>,
    messages: Option<JoinHandle<VecDeque<String>>>,
}

impl Program {
    /// Starts `name` with `arguments`; `destination` is the output that errors name.
    pub fn start<I, A>(
        name: &Path,
        arguments: I,
        destination: &Path,
        output: Stdio,
    ) -> Result<Self, ExportError>
    where
        I: IntoIterator<Item = A>,
        A: AsRef<OsStr>,
    {
        let started = Command::new(name)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(output)
            .stderr(Stdio::piped())
            .spawn();
        let mut child = started.map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => {
                ExportError::ProgramMissing { path: destination.into(), program: name.into() }
            }
            _ => ExportError::create(destination, source),
        })?;
        let stdin = child.stdin.take();
        // Read all along: a program blocked on a full pipe of messages would never take the next picture.
        let messages = child.stderr.take().map(|stderr| thread::spawn(move || last_lines(stderr)));
        Ok(Self { name: name.into(), destination: destination.into(), child, stdin, messages })
    }

    /// Feeds `bytes` to its input. When it has ended, the error is its own last words.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<(), ExportError> {
        let fed = match &mut self.stdin {
            Some(stdin) => stdin.write_all(bytes),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        };
        match fed {
            Ok(()) => Ok(()),
            Err(_) => Err(self.failure()),
        }
    }

    /// Closes its input and waits for a good end.
    pub fn finish(mut self) -> Result<(), ExportError> {
        self.stdin = None;
        match self.child.wait() {
            Ok(status) if status.success() => Ok(()),
            _ => Err(self.failure()),
        }
    }

    /// Closes its input, reads all that it prints, and waits for a good end.
    pub fn output(mut self) -> Result<Vec<u8>, ExportError> {
        self.stdin = None;
        let mut printed = Vec::new();
        if let Some(mut stdout) = self.child.stdout.take() {
            stdout
                .read_to_end(&mut printed)
                .map_err(|source| ExportError::read(&self.destination, source))?;
        }
        self.finish().map(|()| printed)
    }

    /// Ends it and says why. A broken pipe can come before its exit: it is given the time to end by itself.
    fn failure(&mut self) -> ExportError {
        self.stdin = None;
        let status = self.child.wait();
        let lines = self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let last_words = match lines.len() {
            0 => "nothing".into(),
            _ => Vec::from(lines).join(" / "),
        };
        let remedy = if last_words.contains("No space left") {
            "The disk is full: free some space, or name an output on another disk"
        } else if last_words.contains("Unknown encoder") {
            "This ffmpeg has no H.264 encoder; install the distribution's: apt-get install ffmpeg"
        } else if last_words.contains("No such file") || last_words.contains("Invalid data") {
            "Check the path of the clip that the sound comes from, and that it plays"
        } else {
            "Check the folder, the disk and the installed ffmpeg"
        };
        ExportError::ProgramFailed {
            path: self.destination.clone(),
            program: self.name.clone(),
            status: status.map_or_else(|error| error.to_string(), describe),
            last_words,
            remedy,
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // Both fail only when it has already ended, which is what is wanted.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(messages) = self.messages.take() {
            let _ = messages.join();
        }
    }
}

fn describe(status: ExitStatus) -> String {
    status.to_string()
}

fn last_lines(stderr: ChildStderr) -> VecDeque<String> {
    let mut lines = VecDeque::with_capacity(LAST_LINES);
    for line in BufReader::new(stderr).split(b'\n').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line).trim().to_owned();
        if line.is_empty() {
            continue;
        }
        if lines.len() == LAST_LINES {
            lines.pop_front();
        }
        lines.push_back(line);
    }
    lines
}
