//! A performance over the wire: through a file, over UDP with a poor relay between, and between two networks.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod common;

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _},
    net::{SocketAddr, UdpSocket},
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Stdio},
    thread::{self, JoinHandle},
    time::Duration,
};

use common::{Run, finish, folder, james, names, obj_vertices, probe, program, short_clip, track};
use understudy::{
    export::Pc2Reader,
    muscle::{CurveTake, MuscleCurves},
    wire::WireFile,
};

fn send(clip: &Path, arguments: &[&str]) -> Command {
    let mut command = program();
    command.arg("send").arg(clip).args(arguments);
    command
}

fn receive(arguments: &[&str]) -> Command {
    let mut command = program();
    command.arg("receive").args(arguments);
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn curves(path: &Path) -> MuscleCurves {
    CurveTake::read(path).unwrap().curves
}

/// The farthest that a contraction of `got` is from that of `sent` at the same time, and how many frames are missing.
fn compared(sent: &MuscleCurves, got: &MuscleCurves) -> (f64, usize) {
    let start = sent.frames().len() - got.frames().len();
    let mut most = 0.0_f64;
    for frame in got.frames() {
        let same = sent.frames().iter().find(|other| other.time == frame.time);
        let same = same.unwrap_or_else(|| panic!("nothing was sent at {} s", frame.time.seconds()));
        let pairs = same.contractions.iter().zip(&frame.contractions);
        most = pairs.map(|(a, b)| (a - b).abs()).fold(most, f64::max);
    }
    (most, start)
}

/// A receiver that is listening.
struct Listening {
    child: Child,
    out: BufReader<ChildStdout>,
    address: SocketAddr,
    said: String,
}

impl Listening {
    fn start(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut said = String::new();
        let address = loop {
            let mut line = String::new();
            assert!(out.read_line(&mut line).unwrap() > 0, "it does not listen: {said}");
            said += &line;
            if let Some(address) = line.trim().strip_prefix("listening at ") {
                break address.parse().unwrap();
            }
        };
        Self { child, out, address, said }
    }

    fn end(mut self) -> Run {
        let mut stdout = self.said;
        self.out.read_to_string(&mut stdout).unwrap();
        let output = self.child.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        Run { code: output.status.code(), stdout, stderr, command: "receive".into() }
    }
}

/// A line that loses, repeats and exchanges packets and brings foreign ones, the same ones every time.
fn relay(to: SocketAddr, loss: u32) -> (SocketAddr, JoinHandle<u32>) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(3))).unwrap();
    let address = socket.local_addr().unwrap();
    let work = move || {
        let (mut seed, mut lost, mut started) = (7_u32, 0, false);
        let mut chance = |of_thousand: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) % 1000 < of_thousand
        };
        let mut held: Option<Vec<u8>> = None;
        let mut buffer = [0; 2000];
        // The sender takes its time before the first packet.
        loop {
            let Ok(length) = socket.recv(&mut buffer) else {
                if started {
                    return lost;
                }
                continue;
            };
            let packet = buffer[..length].to_vec();
            let is_end = packet[2] & 4 != 0;
            if started && !is_end && chance(loss) {
                lost += 1;
                continue;
            }
            let is_first = !started;
            started = true;
            if !is_first && !is_end && held.is_none() && chance(150) {
                held = Some(packet);
                continue;
            }
            let is_disturbed = chance(200);
            if is_disturbed {
                let mut changed = packet.clone();
                changed[length - 20] ^= 0x40;
                socket.send_to(&changed, to).unwrap();
            }
            socket.send_to(&packet, to).unwrap();
            if is_disturbed {
                socket.send_to(&packet, to).unwrap();
                socket.send_to(&[packet.as_slice(), &[0; 1400]].concat(), to).unwrap();
                socket.send_to(b"uW\x10", to).unwrap();
            }
            if let Some(held) = held.take() {
                socket.send_to(&held, to).unwrap();
            }
        }
    };
    (address, thread::spawn(work))
}

#[test]
fn a_take_goes_through_a_file() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 3.0);
    let take = at("take.uwire");
    let run = finish(&mut send(&clip, &["-o", text(&take)])).succeeded();
    println!("{}", run.stdout);
    assert!(run.stdout.contains("75 frames in 26 packets"), "{}", run.stdout);
    // 6 kbit/s of payload at 30 frames a second, and these are 25.
    let size = fs::metadata(&take).unwrap().len();
    assert!(size < 3 * 750, "{size} bytes");
    finish(&mut send(&clip, &["-o", text(&at("again.uwire"))])).succeeded();
    assert!(fs::read(&take).unwrap() == fs::read(at("again.uwire")).unwrap(), "another run, other bytes");

    // What arrives is what was tracked.
    finish(&mut track(&clip, &at("sent.muscles.csv"), &[])).succeeded();
    let scan = james();
    let mut command = receive(&[text(&take), "--target", text(&scan), "--size", "128x128"]);
    for name in ["got.muscles.csv", "got.pc2", "got.mp4"] {
        command.arg("-o").arg(at(name));
    }
    finish(&mut command).succeeded();
    let (off, missing) = compared(&curves(&at("sent.muscles.csv")), &curves(&at("got.muscles.csv")));
    println!("{off} apart, {missing} frames missing");
    assert!(off < 0.101 && missing == 0);
    assert_eq!(curves(&at("got.muscles.csv")).rate().to_string(), "25");
    assert_eq!(probe(&at("got.mp4"), "v:0", "stream=r_frame_rate,nb_read_packets"), ["25/1,75"]);
    let mut cache = Pc2Reader::open(&at("got.pc2")).unwrap();
    assert_eq!(cache.samples(), 75);
    let (mut first, mut last) = (Vec::new(), Vec::new());
    cache.read_sample(0, &mut first).unwrap();
    cache.read_sample(74, &mut last).unwrap();
    let moved = first.iter().zip(&last).flat_map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()));
    let extent = obj_vertices(&scan).iter().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
    assert!(f64::from(moved.fold(0.0, f32::max)) > 0.01 * extent, "nothing moves");

    a_cut_file_plays_up_to_its_last_packet(folder.path(), &take);
    a_sealed_file_needs_its_key(folder.path(), &clip);
}

fn a_cut_file_plays_up_to_its_last_packet(folder: &Path, take: &Path) {
    let at = |name: &str| folder.join(name);
    let bytes = fs::read(take).unwrap();
    fs::write(at("cut.uwire"), &bytes[..bytes.len() / 2]).unwrap();
    let run = finish(&mut receive(&[text(&at("cut.uwire")), "-o", text(&at("cut.muscles.csv"))])).succeeded();
    run.warned(&["cut.uwire", "it was cut off"]);
    let (whole, cut) = (curves(&at("got.muscles.csv")), curves(&at("cut.muscles.csv")));
    assert!((25..45).contains(&cut.frames().len()), "{} frames", cut.frames().len());
    assert!(whole.frames()[..cut.frames().len()] == *cut.frames());

    fs::write(at("none.uwire"), &bytes[..20]).unwrap();
    let refused = |file: &str, words: &[&str]| {
        let table = at("refused.muscles.csv");
        finish(&mut receive(&[text(&at(file)), "-o", text(&table)])).refused(words);
        assert!(!table.exists());
    };
    refused("none.uwire", &["none.uwire", "0 packets", "empty"]);
    refused("got.muscles.csv", &["got.muscles.csv", "understudy send"]);
    refused("missing.uwire", &["missing.uwire"]);
    finish(&mut receive(&[text(take), "-o", text(&at("x.mp4"))])).refused(&["--target"]);
    finish(&mut receive(&["-o", text(&at("x.muscles.csv"))])).refused(&["--listen"]);
    finish(&mut receive(&[text(take), "-o", text(take)])).refused(&["take.uwire"]);
}

fn a_sealed_file_needs_its_key(folder: &Path, clip: &Path) {
    let at = |name: &str| folder.join(name);
    let (key, sealed) = (at("my.key"), at("sealed.uwire"));
    finish(&mut receive(&["--new-key", text(&key)])).succeeded();
    finish(&mut receive(&["--new-key", text(&key)])).refused(&["my.key", "it exists"]);
    finish(&mut receive(&["--new-key", text(&at("other.key"))])).succeeded();
    finish(&mut send(clip, &["-o", text(&sealed), "--key", text(&key)])).succeeded();
    let table = at("sealed.muscles.csv");
    let open = |more: &[&str]| {
        let mut command = receive(&[text(&sealed), "-o", text(&table)]);
        finish(command.args(more))
    };
    open(&[]).refused(&["sealed.uwire", "encrypted", "--key"]);
    open(&["--key", text(&at("other.key"))]).refused(&["sealed.uwire", "another key"]);
    open(&["--key", text(&sealed)]).refused(&["sealed.uwire", "no key"]);
    open(&["--key", text(&key)]).succeeded();
    assert!(curves(&table) == curves(&at("got.muscles.csv")), "sealed, it is another take");
    assert!(names(folder).iter().all(|name| !name.ends_with(".partial")));
}

#[test]
fn a_take_goes_over_a_poor_line() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 4.0);
    let key = at("my.key");
    finish(&mut receive(&["--new-key", text(&key)])).succeeded();
    let listening = Listening::start(receive(&[
        "--listen",
        "0",
        "--key",
        text(&key),
        "-o",
        text(&at("got.muscles.csv")),
    ]));
    assert!(listening.address.ip().is_loopback());
    let (address, line) = relay(listening.address, 100);
    let to = address.to_string();
    let take = at("take.uwire");
    let run = finish(&mut send(&clip, &["--to", &to, "--key", text(&key), "-o", text(&take)])).succeeded();
    assert!(run.stdout.contains("sending to 127.0.0.1:"), "{}", run.stdout);
    let heard = listening.end().succeeded();
    let lost = line.join().unwrap();
    println!("{lost} packets lost\n{}{}", heard.stdout, heard.stderr);
    assert!(heard.stdout.contains("the sender is done"), "{}", heard.stdout);
    heard.warned(&["ignored: seen already", "ignored: no packets of this program", "ignored: damaged"]);

    let sent = at("sent.muscles.csv");
    finish(&mut receive(&[text(&take), "--key", text(&key), "-o", text(&sent)])).succeeded();
    let (off, missing) = compared(&curves(&sent), &curves(&at("got.muscles.csv")));
    // What arrives is exact, and nothing but what was lost is missing.
    assert!(off < 1e-9, "{off}");
    assert!(
        lost > 1 && (3 * lost - 2..=3 * lost).contains(&(missing as u32)),
        "{missing} frames missing of {lost} packets"
    );
}

/// Sends packets of a file, as fast as they are taken.
fn replay(to: SocketAddr, packets: &[Vec<u8>]) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    for packet in packets {
        socket.send_to(packet, to).unwrap();
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_listener_takes_what_it_should_and_nothing_else() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 3.0);
    finish(&mut send(&clip, &["-o", text(&at("take.uwire")), "--new-key", text(&at("my.key"))])).succeeded();
    let packets = WireFile::read(&at("take.uwire")).unwrap().packets;
    let key = at("my.key");
    let listen = |table: &Path, more: &[&str]| {
        let mut command = receive(&["--listen", "0", "-o", text(table), "--idle", "1"]);
        command.args(more);
        Listening::start(command)
    };

    // Whoever joins late sees a face within a second.
    let late = at("late.muscles.csv");
    let listening = listen(&late, &["--key", text(&key)]);
    replay(listening.address, &packets[4..]);
    listening.end().succeeded();
    let frames = curves(&late).frames().len();
    assert!((75 - 12 - 25..75 - 12).contains(&frames), "{frames} frames");

    // An end that is lost is noticed.
    let listening = listen(&late, &["--key", text(&key)]);
    replay(listening.address, &packets[..packets.len() - 1]);
    let run = listening.end().succeeded();
    assert!(run.stdout.contains("stopped before"), "{}", run.stdout);
    assert_eq!(curves(&late).frames().len(), 75);

    // Nothing that was not sealed with the key counts.
    finish(&mut receive(&["--new-key", text(&at("other.key"))])).succeeded();
    for (more, words) in [
        (vec!["--key", text(&at("other.key"))], "sealed with another key"),
        (vec![], "encrypted: --key FILE is wanted"),
    ] {
        let table = at("wrong.muscles.csv");
        let listening = listen(&table, &[&more[..], &["--wait", "2"]].concat());
        replay(listening.address, &packets);
        replay(listening.address, &[vec![0x75; 3000], vec![], b"uW\x11 and so on, and so on".to_vec()]);
        listening.end().refused(&["127.0.0.1:", "nothing that can be shown", words]);
        assert!(!table.exists());
    }
}

#[test]
fn ports_that_are_taken_and_ports_without_a_listener_are_told() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let table = at("x.muscles.csv");
    finish(&mut receive(&["--listen", &port, "-o", text(&table)])).refused(&[&port, "name another port"]);
    drop(taken);
    let clip = short_clip(folder.path(), 1.0);
    let run = finish(&mut send(&clip, &["--to", &port])).succeeded();
    run.warned(&["nobody listened there", &port]);
    // A scan that nobody can lift by ARKit's muscles has nothing for the wire.
    finish(&mut send(&clip, &["-o", text(&at("x.uwire")), "--basis", "sixteen"]))
        .refused(&["ARKit", "--basis arkit"]);
    finish(&mut send(&clip, &["-o", text(&at("x.mp4"))])).refused(&["x.mp4", ".uwire"]);
}

/// Two networks of their own with a cable between; removed at the end.
struct Cable([String; 2]);

impl Cable {
    fn lay() -> Option<Self> {
        let id = std::process::id();
        let [near, far] = [format!("usn{id}"), format!("usf{id}")];
        let ip = |arguments: &str| {
            let output = Command::new("ip").args(arguments.split_whitespace()).output();
            output.is_ok_and(|output| output.status.success())
        };
        if !ip(&format!("netns add {near}")) {
            return None;
        }
        let cable = Self([near.clone(), far.clone()]);
        let laid = ip(&format!("netns add {far}"))
            && ip(&format!("link add name us0 netns {near} type veth peer name us0 netns {far}"))
            && [(&near, 1), (&far, 2)].iter().all(|(space, host)| {
                ip(&format!("-n {space} addr add 10.77.0.{host}/24 dev us0"))
                    && ip(&format!("-n {space} link set us0 up"))
            });
        laid.then_some(cable)
    }

    fn within(&self, end: usize, command: &Command) -> Command {
        let mut inside = Command::new("ip");
        inside.args(["netns", "exec", &self.0[end]]).arg(command.get_program()).args(command.get_args());
        inside
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for space in &self.0 {
            let _ = Command::new("ip").args(["netns", "del", space]).output();
        }
    }
}

#[test]
fn a_take_goes_from_one_network_to_another() {
    let Some(cable) = Cable::lay() else {
        println!("skipped: this test lays a cable between two network namespaces, which takes root and `ip`");
        return;
    };
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let clip = short_clip(folder.path(), 2.0);
    let table: PathBuf = at("got.muscles.csv");
    let listening =
        Listening::start(cable.within(1, &receive(&["--listen", "10.77.0.2:7331", "-o", text(&table)])));
    finish(&mut cable.within(0, &send(&clip, &["--to", "10.77.0.2:7331"]))).succeeded();
    let run = listening.end().succeeded();
    assert!(run.stdout.contains("50 frames") && run.stdout.contains("the sender is done"), "{}", run.stdout);
    run.warned(&["10.77.0.2:7331", "--key"]);
    assert_eq!(curves(&table).frames().len(), 50);
}
