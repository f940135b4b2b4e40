//! Packets over UDP, one a datagram, when their time has come.

use std::{
    collections::BTreeMap,
    io::{self, ErrorKind},
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket},
    thread,
    time::{Duration, Instant},
};

use super::{Decoder, Ignored, MOST_PACKET, Packet, Received, Timeline, WireError};
use crate::capture::Timestamp;

/// Bytes of the IPv4 and UDP headers around every packet.
pub const HEADERS: usize = 28;
/// How often waiting is looked up from.
const LOOK_UP: Duration = Duration::from_millis(20);
/// Packets that were overtaken by the session's end are waited for this long.
const LINGER: Duration = Duration::from_millis(200);
/// Nothing is sent later than this after another, whatever its time says; a gap in a take is no reason to stop.
const MOST_WAIT: Duration = Duration::from_mins(10);

/// Reads `PORT`, which is this machine's own, or `ADDRESS:PORT`.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    let own = |port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port);
    text.parse::<u16>().map(own).or_else(|_| text.parse()).map_err(|_| {
        "write a port of this machine, such as 7331, or a numeric address and a port, such as 192.168.1.20:7331 or \
         [fe80::1]:7331"
            .to_owned()
    })
}

/// Sends packets to one address.
pub struct Sender {
    socket: UdpSocket,
    start: Instant,
    refused: u64,
}

impl Sender {
    /// The clock of the packets' times starts now.
    pub fn new(to: SocketAddr) -> Result<Self, WireError> {
        let any: IpAddr =
            if to.is_ipv4() { Ipv4Addr::UNSPECIFIED.into() } else { Ipv6Addr::UNSPECIFIED.into() };
        let socket = UdpSocket::bind((any, 0)).and_then(|socket| socket.connect(to).map(|()| socket));
        let remedy = "Check the address, and that this machine has a way there";
        let socket =
            socket.map_err(|source| WireError::Socket { address: to.to_string(), source, remedy })?;
        Ok(Self { socket, start: Instant::now(), refused: 0 })
    }

    /// Waits for a packet's time and sends it. A packet that does not get through is as good as lost.
    pub fn send(&mut self, packet: &Packet) {
        let due = Duration::from_nanos(packet.time.0.max(0).unsigned_abs());
        thread::sleep(due.saturating_sub(self.start.elapsed()).min(MOST_WAIT));
        if self.socket.send(&packet.bytes).is_err() {
            self.refused += 1;
        }
    }

    /// Packets that could not leave; where nobody listens on the same machine, the system says so.
    pub fn refused(&self) -> u64 {
        self.refused
    }
}

/// When to stop listening.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Without a frame for this long from the start, nobody sends.
    pub wait: Duration,
    /// Without a packet of the session for this long, it is over.
    pub idle: Duration,
    /// From the first frame on, however much follows.
    pub longest: Option<Duration>,
}

/// What came.
#[derive(Debug, Clone, Default)]
pub struct Collected {
    /// The frames.
    pub timeline: Timeline,
    /// Whether the sender said that it is done.
    pub ended: bool,
    /// What was ignored, and how often.
    pub ignored: BTreeMap<Ignored, u64>,
}

/// Listens at one address.
pub struct Listener {
    socket: UdpSocket,
    address: SocketAddr,
}

impl Listener {
    /// Port 0 is any free one.
    pub fn bind(address: SocketAddr) -> Result<Self, WireError> {
        let open = || -> io::Result<Self> {
            let socket = UdpSocket::bind(address)?;
            socket.set_read_timeout(Some(LOOK_UP))?;
            let address = socket.local_addr()?;
            Ok(Self { socket, address })
        };
        open().map_err(|source| {
            let remedy = match source.kind() {
                ErrorKind::AddrInUse => "Another program listens there: stop it, or name another port",
                ErrorKind::PermissionDenied => "Ports below 1024 are the system's: name a higher one",
                _ => "Name an address of this machine, such as 127.0.0.1, or 0.0.0.0 for all it has",
            };
            WireError::Socket { address: address.to_string(), source, remedy }
        })
    }

    /// Where.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Collects one session's frames. `progress` is told how many came.
    pub fn collect(
        &self,
        decoder: &mut Decoder,
        limits: Limits,
        mut progress: impl FnMut(u64),
    ) -> Result<Collected, WireError> {
        let start = Instant::now();
        let (mut first, mut heard, mut end) = (None, start, None);
        let mut collected = Collected::default();
        // One byte more tells a packet that is too long.
        let mut buffer = [0; MOST_PACKET + 1];
        let mut salt = None;
        loop {
            let now = start.elapsed();
            let is_over = match first {
                None => now > limits.wait,
                Some(first) => {
                    let whole = limits.longest.is_some_and(|longest| now.saturating_sub(first) > longest);
                    let ended = end.is_some_and(|end| now.saturating_sub(end) > LINGER);
                    whole || ended || heard.elapsed() > limits.idle
                }
            };
            if is_over {
                break;
            }
            // A datagram that cannot be taken is one that is lost.
            let Ok((length, _)) = self.socket.recv_from(&mut buffer) else { continue };
            let now = start.elapsed();
            let taken = decoder.receive(&buffer[..length], Timestamp(now.as_nanos() as i64));
            if let (Ok(_), Some(known)) = (&taken, &salt)
                && decoder.salt() != Some(known)
            {
                // Another session begins, and this one is over.
                break;
            }
            match taken {
                Err(reason) => {
                    *collected.ignored.entry(reason).or_default() += 1;
                    continue;
                }
                Ok(Received::End) => {
                    collected.ended = true;
                    end = end.or(Some(now));
                }
                Ok(Received::Frames(frames)) => {
                    first = first.or(Some(now));
                    collected.timeline.extend(frames);
                    progress(collected.timeline.frames().len() as u64);
                }
            }
            salt = decoder.salt().copied();
            heard = Instant::now();
        }
        if first.is_some() {
            return Ok(collected);
        }
        let reasons: Vec<String> =
            collected.ignored.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
        let ignored = if reasons.is_empty() {
            String::new()
        } else {
            format!(" (ignored packets: {})", reasons.join("; "))
        };
        let (address, seconds) = (self.address.to_string(), limits.wait.as_secs_f64());
        Err(WireError::Silence { address, seconds, ignored })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_this_machines() {
        assert_eq!(address("7331").unwrap().to_string(), "127.0.0.1:7331");
        assert_eq!(address("0.0.0.0:1").unwrap().to_string(), "0.0.0.0:1");
        assert_eq!(address("[::1]:80").unwrap().to_string(), "[::1]:80");
        for wrong in ["", "host:1", "70000", "1.2.3.4", "-1"] {
            assert!(address(wrong).unwrap_err().contains("192.168.1.20:7331"), "{wrong}");
        }
    }

    #[test]
    fn a_taken_port_and_silence_are_told() {
        let listener = Listener::bind(address("0").unwrap()).unwrap();
        let said = Listener::bind(listener.address()).err().unwrap().to_string();
        assert!(
            said.contains(&listener.address().to_string()) && said.contains("name another port"),
            "{said}"
        );
        let limits = Limits { wait: Duration::from_millis(60), idle: Duration::from_secs(1), longest: None };
        let said = listener.collect(&mut Decoder::new(None), limits, |_| {}).unwrap_err().to_string();
        assert!(said.contains("0.06 s") && said.contains("Start the sender"), "{said}");
    }
}
