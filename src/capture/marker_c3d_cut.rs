//! What of a C3D file `c3dio` is given to read.
//!
//! The crate trusts every count and offset in the file, allocates what a header asks for, and refuses files whose analog
//! channels it does not understand. So the file's skeleton is walked first, within its bounds, and then cut down to the
//! header, the parameters and the points.

use std::ops::Range;

use super::marker_take::Fault;

const BLOCK: usize = 512;
/// Where the parameters start, in blocks from 1; the crate knows no other place, and hardly any writer does.
const PARAMETER_BLOCK: u8 = 2;
/// The second byte of the header and of the parameters.
const MAGIC: u8 = 0x50;
/// The groups that are needed; others are hidden from the crate, which panics on some of what they may hold.
const GROUPS: [&[u8]; 2] = [b"POINT", b"TRIAL"];
/// The crate gives groups that it misses the next numbers, in 7 bits.
const MOST_GROUPS: u8 = 100;
/// The crate counts the bytes of a frame's points in 16 bits.
const MOST_POINT_BYTES: usize = u16::MAX as usize;

/// A copy of the file without analog channels and without other groups of parameters, every count in it held against
/// what is there.
pub(super) fn cut(bytes: &[u8]) -> Result<Vec<u8>, Fault> {
    let short = || Fault::damaged(format!("{} bytes are too few for a C3D file", bytes.len()));
    let header = bytes.get(..BLOCK).ok_or_else(short)?;
    if header[1] != MAGIC {
        return Err(Fault::new("it does not start as C3D files do", "Export the take as C3D or CSV again"));
    }
    if header[0] != PARAMETER_BLOCK {
        return Err(Fault::damaged(format!("its parameters start at block {}, not 2", header[0])));
    }
    let processor = *bytes.get(BLOCK + 3).ok_or_else(short)?;
    let order = match processor {
        0x54 | 0x55 => Order::Little,
        0x56 => Order::Big,
        _ => {
            return Err(Fault::damaged(format!("its processor type is {processor}, and 84 to 86 are known")));
        }
    };
    // The sign of the scale says how numbers are stored; each processor keeps it elsewhere.
    let sign = header[match processor {
        0x54 => 15,
        0x55 => 13,
        _ => 12,
    }];
    let floats = sign & 0x80 != 0 || header[12..16] == [0; 4];
    let (point_bytes, sample_bytes) = if floats { (16, 4) } else { (8, 2) };

    let count = |at: usize| usize::from(order.u16([header[at], header[at + 1]]));
    let (markers, samples, first, last) = (count(2), count(4), count(6), count(8));
    if markers == 0 {
        return Err(Fault::new("it names no markers", "Export the take with its labelled markers"));
    }
    let in_points = markers * point_bytes;
    if in_points > MOST_POINT_BYTES {
        return Err(Fault::new(format!("it has {markers} markers"), "Export the markers of one face"));
    }
    let start = count(16).saturating_sub(1) * BLOCK;
    if start < 2 * BLOCK || start > bytes.len() {
        return Err(Fault::damaged(format!("its data would start at byte {start} of {}", bytes.len())));
    }
    let frame = in_points + samples * sample_bytes;
    let there = (bytes.len() - start) / frame;
    let promised = (last + 1).saturating_sub(first);
    if promised > there {
        let reason = format!("it is cut off: its header promises {promised} frames, and {there} are there");
        return Err(Fault::damaged(reason));
    }

    let mut kept = bytes[..start].to_vec();
    hide_groups(&mut kept[BLOCK..], order)?;
    kept[4..6].fill(0);
    kept[18..20].fill(0);
    // The crate adds 1 to the difference of these within 16 bits.
    let listed = order.bytes(there.clamp(1, usize::from(u16::MAX) - 1) as u16);
    kept[6..8].copy_from_slice(&order.bytes(1));
    kept[8..10].copy_from_slice(&listed);
    for frame in bytes[start..].chunks_exact(frame) {
        kept.extend_from_slice(&frame[..in_points]);
    }
    Ok(kept)
}

#[derive(Clone, Copy)]
enum Order {
    Little,
    Big,
}

impl Order {
    fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Little => u16::from_le_bytes(bytes),
            Self::Big => u16::from_be_bytes(bytes),
        }
    }

    fn bytes(self, value: u16) -> [u8; 2] {
        match self {
            Self::Little => value.to_le_bytes(),
            Self::Big => value.to_be_bytes(),
        }
    }
}

/// Walks the chain of groups and parameters as the crate does and writes the names of groups that are not wanted in
/// lower case, by which the crate does not know them.
fn hide_groups(section: &mut [u8], order: Order) -> Result<(), Fault> {
    let mut at = 4;
    let (mut first, mut last) = (None, None);
    while let Some(&id) = section.get(at + 1) {
        if id == 0 {
            break;
        }
        let is_group = id & 0x80 != 0;
        let damaged = || Fault::damaged(format!("its parameters are damaged {at} bytes in"));
        if (id as i8).unsigned_abs() > MOST_GROUPS {
            return Err(damaged());
        }
        let entry = entry(section, at, is_group, order).ok_or_else(damaged)?;
        match &section[entry.name.clone()] {
            name if name.eq_ignore_ascii_case(b"ACTUAL_START_FIELD") => first = entry.pair,
            name if name.eq_ignore_ascii_case(b"ACTUAL_END_FIELD") => last = entry.pair,
            _ => {}
        }
        at = entry.next;
    }
    // The crate counts the upper half of these in 16 bits.
    for [_, upper] in [first, last].into_iter().flatten() {
        if upper > 1 {
            let reason = "it has more than 131071 frames";
            return Err(Fault::new(reason, "Cut the take into shorter ones"));
        }
    }
    if let (Some(first), Some(last)) = (first, last)
        && [first[1], first[0]] > [last[1], last[0]]
    {
        return Err(Fault::damaged("it would end before it starts"));
    }
    Ok(())
}

/// What is needed of a group or parameter.
struct Entry {
    name: Range<usize>,
    /// The first two whole numbers of a parameter that holds two or more.
    pair: Option<[u16; 2]>,
    /// Where the next one starts.
    next: usize,
}

/// One group or parameter; `None` where it reaches beyond the section.
fn entry(section: &mut [u8], at: usize, is_group: bool, order: Order) -> Option<Entry> {
    let length = usize::from((section[at] as i8).unsigned_abs());
    if length > 127 {
        return None;
    }
    let name = section.get_mut(at + 2..at + 2 + length)?;
    if is_group {
        name.make_ascii_uppercase();
        if !GROUPS.contains(&&*name) {
            name.make_ascii_lowercase();
        }
    }
    let offset = at + 2 + length;
    let next = offset + usize::from(order.u16([*section.get(offset)?, *section.get(offset + 1)?]));
    let mut end = offset + 2;
    let mut pair = None;
    if !is_group {
        let size: usize = match *section.get(end)? as i8 {
            -1 | 1 => 1,
            2 => 2,
            4 => 4,
            _ => return None,
        };
        let dimensions = usize::from(*section.get(end + 1)?);
        let dimensions = section.get(end + 2..end + 2 + dimensions)?;
        end += 2 + dimensions.len();
        // As the crate counts: a size of 0 is passed over.
        let values =
            dimensions.iter().filter(|d| **d > 0).try_fold(size, |all, d| all.checked_mul(usize::from(*d)));
        let values = section.get(end..end.checked_add(values?)?)?;
        if let (2, [a, b, c, d, ..]) = (size, values) {
            pair = Some([order.u16([*a, *b]), order.u16([*c, *d])]);
        }
        end += values.len();
    }
    let description = usize::from(*section.get(end)?);
    section.get(end + 1..end + 1 + description)?;
    Some(Entry { name: at + 2..offset, pair, next })
}
