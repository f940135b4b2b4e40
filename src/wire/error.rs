//! What can go wrong beyond packets, which are ignored when they are wrong.

use std::{io, path::PathBuf};

use crate::export::ExportError;

/// Of files, keys and sockets. What a packet has wrong is [`Ignored`](super::Ignored).
#[derive(Debug, thiserror::Error)]
pub enum WireError {
    /// A file that cannot be read.
    #[error("{}: {source}. Check the name, and that it may be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file of another kind.
    #[error("{}: {reason}. Give a file that `understudy send -o take.uwire` wrote", path.display())]
    NoWireFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A file without a frame that can be shown.
    #[error("{}: none of its {packets} packets can be shown: {reason}", path.display())]
    NothingToShow {
        /// The file.
        path: PathBuf,
        /// Packets in it.
        packets: usize,
        /// Of the first that was ignored.
        reason: String,
    },
    /// A key file that is none.
    #[error("{}: it is no key, which is one line of 64 hexadecimal digits. Make one with --new-key FILE", path.display())]
    NoKey {
        /// The file.
        path: PathBuf,
    },
    /// The system gives no random numbers.
    #[error("the system gives no random numbers ({source}), without which no key or session can be made")]
    NoRandomness {
        /// Why.
        source: getrandom::Error,
    },
    /// A take that lasts too long for its clock, or whose times do not ascend.
    #[error("the frame at {seconds} s cannot be sent: {reason}")]
    BadTime {
        /// Its time.
        seconds: f64,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A socket that cannot be opened.
    #[error("{address}: {source}. {remedy}")]
    Socket {
        /// Where.
        address: String,
        /// Why.
        source: io::Error,
        /// What to do.
        remedy: &'static str,
    },
    /// Nobody sent anything that could be shown.
    #[error(
        "{address}: nothing that can be shown arrived within {seconds} s{ignored}. Start the sender, or check its --to and --key"
    )]
    Silence {
        /// Where.
        address: String,
        /// How long was waited.
        seconds: f64,
        /// What else arrived, in words; empty where nothing did.
        ignored: String,
    },
    /// Outputs.
    #[error(transparent)]
    Export(#[from] ExportError),
}
