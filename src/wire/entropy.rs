//! Whole numbers as few bits: yes-or-no decisions of known probability, through a range coder.
//!
//! Probabilities are integers in 4096ths, so that both ends agree on any machine.

use std::{borrow::Borrow, num::NonZeroU16};

use constriction::stream::{
    Decode, Encode,
    model::{DecoderModel, EncoderModel, EntropyModel},
    queue::{RangeDecoder, RangeEncoder},
};

/// Bits of a probability.
const PRECISION: usize = 12;
const WHOLE: u16 = 1 << PRECISION;
/// Steps of a size that are told one by one; what is larger still is told in binary.
const MOST_STEPS: u32 = 24;
/// No number on the wire has more bits.
const MOST_BITS: u32 = 32;

/// How often each level of [`Shape::zero`] is zero, in 4096ths.
const ZEROS: [u16; 8] = [164, 614, 1434, 2253, 3072, 3686, 3994, 4086];
/// For each [`Shape::size`]: low bits that are told as they are, and how often each further step is the last.
const SIZES: [(u32, u16); 16] = [
    (0, 3562),
    (0, 3151),
    (0, 2731),
    (0, 2276),
    (0, 1862),
    (0, 1463),
    (0, 1170),
    (0, 910),
    (1, 1260),
    (1, 964),
    (2, 1321),
    (2, 999),
    (3, 1339),
    (3, 1009),
    (4, 1352),
    (4, 1016),
];
/// What a zero costs at each level of [`Shape::zero`], and what any other value does; in 64ths of a bit, like all costs.
const ZERO_COSTS: [(u64, u64); 8] =
    [(297, 4), (175, 15), (97, 40), (55, 74), (27, 128), (10, 213), (2, 341), (0, 555)];
/// What each step of a size costs at each [`Shape::size`], and the last one.
const SIZE_COSTS: [(u64, u64); 16] = [
    (188, 13),
    (135, 24),
    (101, 37),
    (75, 54),
    (56, 73),
    (41, 95),
    (31, 116),
    (23, 139),
    (34, 109),
    (25, 134),
    (36, 104),
    (26, 130),
    (37, 103),
    (26, 129),
    (37, 102),
    (26, 129),
];
const BIT: u64 = 64;

/// The bytes are not what an encoder writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the content of a packet is damaged")]
pub struct Damaged;

/// How the values of a channel are spread about their centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Shape {
    /// How often they are zero: 0 hardly ever, 7 nearly always.
    pub zero: u8,
    /// How large they are where they are not: 0 one step, 15 some sixty.
    pub size: u8,
}

/// What is known of values before their shape is chosen.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    zeros: u64,
    others: u64,
    /// Of all sizes, after so many low bits.
    steps: [u64; 5],
}

impl Tally {
    /// Of values.
    pub fn of(values: impl Iterator<Item = i32>) -> Self {
        let mut tally = Self::default();
        for value in values {
            if value == 0 {
                tally.zeros += 1;
                continue;
            }
            tally.others += 1;
            let size = value.unsigned_abs() - 1;
            for (low, steps) in (0..).zip(&mut tally.steps) {
                *steps += u64::from((size >> low).min(2 * MOST_STEPS));
            }
        }
        tally
    }

    /// The bits that they cost in a shape.
    pub fn bits(&self, shape: Shape) -> u64 {
        let (zero, other) = ZERO_COSTS[usize::from(shape.zero)];
        let (low, _) = SIZES[usize::from(shape.size)];
        let (step, last) = SIZE_COSTS[usize::from(shape.size)];
        let each = other + BIT * (1 + u64::from(low)) + last;
        (self.zeros * zero + self.others * each + self.steps[low as usize] * step) / BIT
    }
}

/// A decision: how often it is `false`, in 4096ths, never none or all.
#[derive(Clone, Copy)]
struct Odds(u16);

impl Odds {
    fn of(self, bit: bool) -> (u16, NonZeroU16) {
        let no = self.0.clamp(1, WHOLE - 1);
        let (from, wide) = if bit { (no, WHOLE - no) } else { (0, no) };
        (from, NonZeroU16::new(wide).unwrap_or(NonZeroU16::MIN))
    }
}

impl EntropyModel<PRECISION> for Odds {
    type Symbol = bool;
    type Probability = u16;
}

impl EncoderModel<PRECISION> for Odds {
    fn left_cumulative_and_probability(&self, symbol: impl Borrow<bool>) -> Option<(u16, NonZeroU16)> {
        Some(self.of(*symbol.borrow()))
    }
}

impl DecoderModel<PRECISION> for Odds {
    fn quantile_function(&self, quantile: u16) -> (bool, u16, NonZeroU16) {
        let bit = quantile >= self.0.clamp(1, WHOLE - 1);
        let (from, wide) = self.of(bit);
        (bit, from, wide)
    }
}

/// A decision whose odds are learnt as it is made again and again, at both ends alike.
#[derive(Debug, Clone, Copy)]
pub struct Learnt([u16; 2]);

impl Default for Learnt {
    fn default() -> Self {
        Self([1, 1])
    }
}

impl Learnt {
    fn odds(self) -> Odds {
        let [no, yes] = self.0.map(u32::from);
        Odds((u32::from(WHOLE) * no / (no + yes)) as u16)
    }

    fn learn(&mut self, bit: bool) {
        self.0[usize::from(bit)] += 2;
        if self.0[0] + self.0[1] > 500 {
            self.0 = self.0.map(|count| count.div_ceil(2));
        }
    }
}

/// Writes decisions.
pub struct Writer(RangeEncoder<u16, u32>);

impl Default for Writer {
    fn default() -> Self {
        Self(RangeEncoder::new())
    }
}

impl Writer {
    fn put(&mut self, bit: bool, odds: Odds) {
        // Neither can it fail: every decision is possible, and memory is its only limit.
        let _ = self.0.encode_symbol(bit, odds);
    }

    /// The low `count` bits of a number.
    pub fn bits(&mut self, value: u32, count: u32) {
        for place in (0..count).rev() {
            self.put(value >> place & 1 == 1, Odds(WHOLE / 2));
        }
    }

    /// A decision whose odds are learnt.
    pub fn learnt(&mut self, bit: bool, odds: &mut Learnt) {
        self.put(bit, odds.odds());
        odds.learn(bit);
    }

    /// A number below the number of `tree`'s entries, which is a power of two.
    pub fn choice(&mut self, value: u8, tree: &mut [Learnt]) {
        let mut node = 1;
        for place in (0..tree.len().ilog2()).rev() {
            let bit = value >> place & 1 == 1;
            self.learnt(bit, &mut tree[node]);
            node = 2 * node + usize::from(bit);
        }
    }

    /// A number that is spread as `shape` says.
    pub fn value(&mut self, value: i32, shape: Shape) {
        self.put(value != 0, Odds(ZEROS[usize::from(shape.zero)]));
        if value == 0 {
            return;
        }
        self.put(value < 0, Odds(WHOLE / 2));
        let (low, last) = SIZES[usize::from(shape.size)];
        let size = value.unsigned_abs() - 1;
        let steps = size >> low;
        for _ in 0..steps.min(MOST_STEPS) {
            self.put(true, Odds(last));
        }
        if steps < MOST_STEPS {
            self.put(false, Odds(last));
        } else {
            let rest = steps - MOST_STEPS + 1;
            let length = rest.ilog2();
            self.bits(length, 5);
            self.bits(rest, length);
        }
        self.bits(size, low);
    }

    /// All that was written.
    pub fn finish(self) -> Vec<u8> {
        let Ok(words) = self.0.into_compressed();
        let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
        // A reader that has come to the end reads zeros.
        while bytes.last() == Some(&0) {
            bytes.pop();
        }
        bytes
    }
}

/// Reads what [`Writer`] wrote.
pub struct Reader(RangeDecoder<u16, u32, constriction::backends::Cursor<u16, Vec<u16>>>);

impl Reader {
    /// Of all bytes that were written.
    pub fn new(bytes: &[u8]) -> Result<Self, Damaged> {
        let word = |pair: &[u8]| u16::from_be_bytes([pair[0], pair.get(1).copied().unwrap_or(0)]);
        let mut words: Vec<u16> = bytes.chunks(2).map(word).collect();
        // The coder's whole state is read ahead.
        words.extend([0; 2]);
        RangeDecoder::from_compressed(words).map(Self).map_err(|_| Damaged)
    }

    fn get(&mut self, odds: Odds) -> Result<bool, Damaged> {
        self.0.decode_symbol(odds).map_err(|_| Damaged)
    }

    /// A number of `count` bits.
    pub fn bits(&mut self, count: u32) -> Result<u32, Damaged> {
        (0..count).try_fold(0, |value, _| Ok(value << 1 | u32::from(self.get(Odds(WHOLE / 2))?)))
    }

    /// A decision whose odds are learnt.
    pub fn learnt(&mut self, odds: &mut Learnt) -> Result<bool, Damaged> {
        let bit = self.get(odds.odds())?;
        odds.learn(bit);
        Ok(bit)
    }

    /// A number below the number of `tree`'s entries, which is a power of two.
    pub fn choice(&mut self, tree: &mut [Learnt]) -> Result<u8, Damaged> {
        let mut node = 1;
        for _ in 0..tree.len().ilog2() {
            node = 2 * node + usize::from(self.learnt(&mut tree[node])?);
        }
        Ok((node - tree.len()) as u8)
    }

    /// A number that is spread as `shape` says.
    pub fn value(&mut self, shape: Shape) -> Result<i32, Damaged> {
        if !self.get(Odds(ZEROS[usize::from(shape.zero)]))? {
            return Ok(0);
        }
        let negative = self.get(Odds(WHOLE / 2))?;
        let (low, last) = SIZES[usize::from(shape.size)];
        let mut steps = 0;
        while steps < MOST_STEPS && self.get(Odds(last))? {
            steps += 1;
        }
        let mut size = i64::from(steps);
        if steps == MOST_STEPS {
            let length = self.bits(5)?;
            size += (1_i64 << length | i64::from(self.bits(length)?)) - 1;
        }
        debug_assert!(low < MOST_BITS);
        size = size << low | i64::from(self.bits(low)?);
        let value = if negative { -(size + 1) } else { size + 1 };
        i32::try_from(value).map_err(|_| Damaged)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_a_tally_foretells_is_what_it_costs() {
        for (shape, values) in [
            (Shape { zero: 6, size: 3 }, [0, 0, 0, 2, 0, -1, 0, 0, 0, 3]),
            (Shape { zero: 0, size: 13 }, [70, -64, 55, 80, 1, -20, 33, 17, -2, 40]),
            (Shape { zero: 3, size: 8 }, [0, 1, 2, -3, 4, -5, 6, 7, 0, 0]),
        ] {
            let mut writer = Writer::default();
            let many = || values.into_iter().cycle().take(1000);
            for value in many() {
                writer.value(value, shape);
            }
            let (told, cost) = (Tally::of(many()).bits(shape), writer.finish().len() as u64 * 8);
            assert!(told.abs_diff(cost) < 20 + cost / 100, "{told} bits foretold, {cost} needed");
        }
    }

    #[test]
    fn what_fits_costs_what_it_must() {
        // Values of a geometric spread cost their entropy and a few hundredths.
        let (mut seed, mut values) = (1_u32, Vec::new());
        for _ in 0..4000 {
            let mut value = 0;
            loop {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                if seed >> 30 == 0 || value == 60 {
                    break;
                }
                value += 1;
            }
            values.push(if seed & 1 << 20 == 0 { value } else { -value });
        }
        let shape = Shape { zero: 1, size: 6 };
        let mut writer = Writer::default();
        for value in &values {
            writer.value(*value, shape);
        }
        let bits = writer.finish().len() as f64 * 8.0 / values.len() as f64;
        // −Σ p log₂ p of ¼·(¾)ᵏ, and a sign for three of four.
        let entropy = (0..200).map(|k| 0.25 * 0.75_f64.powi(k)).map(|p| -p * p.log2()).sum::<f64>() + 0.75;
        assert!(bits < entropy + 0.1, "{bits} bits where {entropy} are needed");
    }

    proptest! {
        #[test]
        fn everything_comes_back(
            values in prop::collection::vec((any::<i32>().prop_map(|v| v.max(-i32::MAX) >> (v & 31)), 0_u8..8, 0_u8..16), 0..60),
            choices in prop::collection::vec(0_u8..16, 0..20),
        ) {
            let mut writer = Writer::default();
            let mut tree = [Learnt::default(); 16];
            for (value, zero, size) in &values {
                writer.value(*value, Shape { zero: *zero, size: *size });
            }
            for choice in &choices {
                writer.choice(*choice, &mut tree);
            }
            writer.bits(0xabcd, 16);
            let bytes = writer.finish();
            let mut reader = Reader::new(&bytes).unwrap();
            let mut tree = [Learnt::default(); 16];
            for (value, zero, size) in &values {
                prop_assert_eq!(reader.value(Shape { zero: *zero, size: *size }), Ok(*value));
            }
            for choice in &choices {
                prop_assert_eq!(reader.choice(&mut tree), Ok(*choice));
            }
            prop_assert_eq!(reader.bits(16), Ok(0xabcd));
        }

        #[test]
        fn garbage_is_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let mut reader = Reader::new(&bytes).unwrap();
            for k in 0_u8..200 {
                if reader.value(Shape { zero: k % 8, size: k % 16 }).is_err() {
                    break;
                }
            }
        }
    }
}
