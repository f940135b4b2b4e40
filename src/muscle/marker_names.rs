//! Where a marker's name says it sits.
//!
//! Studios name markers as they like; names hold a part of the face, a side, and where on the part. They are cut into
//! such words (`Mouth_UpL1`: mouth, up, left, 1), which a table of places answers.

use crate::{lift::Side, tracking::SKIN_LANDMARK_COUNT};

/// A part of the face that markers are named after.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Forehead,
    Temple,
    Brow,
    Eye,
    Lid,
    Nose,
    Cheek,
    Mouth,
    Chin,
    Jaw,
}

/// Where on the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum On {
    Up,
    Down,
    In,
    Out,
    Corner,
    Tip,
    Bridge,
    Wing,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Word {
    Part(Part),
    On(On),
    Side(Side),
    Number(usize),
    /// The rest of the name is the landmark's number.
    Landmark,
    /// Tells nothing that the lack of a side does not.
    Middle,
}

use On::{Bridge, Corner, Down, In, Out, Tip, Up, Wing};
use Part::{Brow, Cheek, Chin, Eye, Forehead, Jaw, Lid, Mouth, Nose, Temple};

const WORDS: &[(&str, &[Word])] = &[
    ("forehead", &[Word::Part(Forehead)]),
    ("temple", &[Word::Part(Temple)]),
    ("eyebrow", &[Word::Part(Brow)]),
    ("brow", &[Word::Part(Brow)]),
    ("glabella", &[Word::Part(Brow)]),
    ("eyelid", &[Word::Part(Lid)]),
    ("lid", &[Word::Part(Lid)]),
    ("eye", &[Word::Part(Eye)]),
    ("canthus", &[Word::Part(Eye)]),
    ("nose", &[Word::Part(Nose)]),
    ("nasion", &[Word::Part(Nose), Word::On(Up)]),
    ("nostril", &[Word::Part(Nose), Word::On(Wing)]),
    ("alare", &[Word::Part(Nose), Word::On(Wing)]),
    ("cheekbone", &[Word::Part(Cheek), Word::On(Up)]),
    ("cheek", &[Word::Part(Cheek)]),
    ("mouth", &[Word::Part(Mouth)]),
    ("lips", &[Word::Part(Mouth)]),
    ("lip", &[Word::Part(Mouth)]),
    ("cheilion", &[Word::Part(Mouth), Word::On(Corner)]),
    ("chin", &[Word::Part(Chin)]),
    ("jaw", &[Word::Part(Jaw)]),
    ("upper", &[Word::On(Up)]),
    ("top", &[Word::On(Up)]),
    ("up", &[Word::On(Up)]),
    ("lower", &[Word::On(Down)]),
    ("bottom", &[Word::On(Down)]),
    ("down", &[Word::On(Down)]),
    ("low", &[Word::On(Down)]),
    ("base", &[Word::On(Down)]),
    ("inside", &[Word::On(In)]),
    ("inner", &[Word::On(In)]),
    ("in", &[Word::On(In)]),
    ("outside", &[Word::On(Out)]),
    ("outer", &[Word::On(Out)]),
    ("out", &[Word::On(Out)]),
    ("corner", &[Word::On(Corner)]),
    ("end", &[Word::On(Corner)]),
    ("head", &[Word::On(Tip)]),
    ("tip", &[Word::On(Tip)]),
    ("bridge", &[Word::On(Bridge)]),
    ("wing", &[Word::On(Wing)]),
    ("ala", &[Word::On(Wing)]),
    ("side", &[]),
    ("left", &[Word::Side(Side::Left)]),
    ("l", &[Word::Side(Side::Left)]),
    ("right", &[Word::Side(Side::Right)]),
    ("r", &[Word::Side(Side::Right)]),
    ("middle", &[Word::Middle]),
    ("center", &[Word::Middle]),
    ("centre", &[Word::Middle]),
    ("mid", &[Word::Middle]),
    ("m", &[Word::Middle]),
    ("c", &[Word::Middle]),
    ("landmark", &[Word::Landmark]),
    ("lm", &[Word::Landmark]),
];

/// A place that words name: the part, where on it, whether it has sides, a number, the landmark on the subject's right or
/// the midline, and whether studios agree where it is.
type Rule = (Part, &'static [On], bool, Option<usize>, usize, bool);

/// Of the rules that ask for nothing the name lacks the one that asks for most counts, of those the first.
const RULES: &[Rule] = &[
    (Forehead, &[], false, None, 151, false),
    (Forehead, &[Up], false, None, 10, false),
    (Forehead, &[], true, None, 104, false),
    (Forehead, &[In], true, None, 69, false),
    (Forehead, &[Out], true, None, 54, false),
    (Temple, &[], true, None, 139, false),
    (Brow, &[], false, None, 9, true),
    (Brow, &[], true, None, 105, true),
    (Brow, &[In], true, None, 107, true),
    (Brow, &[Out], true, None, 70, true),
    (Eye, &[Up], true, None, 27, true),
    (Eye, &[Down], true, None, 23, true),
    (Eye, &[In], true, None, 133, true),
    (Eye, &[Out], true, None, 33, true),
    (Lid, &[Up], true, None, 159, true),
    (Lid, &[Down], true, None, 145, true),
    (Nose, &[], false, None, 4, true),
    (Nose, &[Up], false, None, 168, true),
    (Nose, &[Bridge], false, None, 6, true),
    (Nose, &[Down], false, None, 2, true),
    (Nose, &[], true, None, 129, true),
    (Cheek, &[], true, None, 50, false),
    (Cheek, &[Down], true, None, 187, false),
    (Cheek, &[Out], true, None, 123, false),
    (Cheek, &[In], true, None, 36, false),
    (Mouth, &[Up], false, None, 0, true),
    (Mouth, &[Down], false, None, 17, true),
    (Mouth, &[], true, None, 61, true),
    (Mouth, &[Up], true, None, 39, true),
    (Mouth, &[Up, In], true, None, 37, true),
    (Mouth, &[Up, Out], true, None, 40, true),
    (Mouth, &[Down], true, None, 181, true),
    (Mouth, &[Down, In], true, None, 84, true),
    (Mouth, &[Down, Out], true, None, 91, true),
    (Mouth, &[Corner], true, None, 61, true),
    (Chin, &[], false, None, 199, true),
    (Chin, &[Up], false, None, 200, true),
    (Chin, &[Down], false, None, 152, true),
    (Chin, &[], true, None, 171, false),
    (Chin, &[], true, Some(2), 136, false),
    (Jaw, &[], false, None, 152, true),
    (Jaw, &[], true, None, 136, false),
    (Jaw, &[Up], true, None, 58, false),
];

/// What a name says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Named {
    /// The landmark, on the side that is named.
    pub landmark: usize,
    /// `None` on the midline.
    pub side: Option<Side>,
    /// Whether studios agree where this is; cheeks are wide.
    pub firm: bool,
    /// Whether it gives the landmark's number.
    pub exact: bool,
    /// The words but the side: the same for both of a pair.
    key: Vec<Word>,
}

impl Named {
    /// Whether both are one place on either side.
    pub fn mirrors(&self, other: &Self) -> bool {
        self.key == other.key && self.side.is_some() && self.side != other.side
    }
}

/// What `name` says; `None` where it says too little.
pub(super) fn place_by_name(name: &str) -> Option<Named> {
    let mut words = words(name);
    let mut side = None;
    for word in &words {
        if let Word::Side(found) = *word {
            if side.is_some_and(|side| side != found) {
                return None;
            }
            side = Some(found);
        }
    }
    words.retain(|word| !matches!(word, Word::Side(_) | Word::Middle));
    words.sort_unstable();
    let number = words.iter().find_map(|word| if let Word::Number(n) = word { Some(*n) } else { None });
    if words.contains(&Word::Landmark) {
        let landmark = number.filter(|n| *n < SKIN_LANDMARK_COUNT)?;
        return Some(Named { landmark, side: None, firm: true, exact: true, key: words });
    }
    let asks = |(part, on, sided, wanted, _, _): &&Rule| {
        words.contains(&Word::Part(*part))
            && on.iter().all(|on| words.contains(&Word::On(*on)))
            && *sided == side.is_some()
            && wanted.is_none_or(|wanted| number == Some(wanted))
    };
    let demands = |(_, on, _, wanted, _, _): &Rule| on.len() + usize::from(wanted.is_some());
    let best = RULES.iter().filter(asks).rev().max_by_key(|rule| demands(rule))?;
    let &(_, _, _, _, landmark, firm) = best;
    let mirror = crate::tracking::landmark_table()[landmark].mirror;
    let landmark = if side == Some(Side::Left) { mirror } else { landmark };
    Some(Named { landmark, side, firm, exact: false, key: words })
}

fn words(name: &str) -> Vec<Word> {
    let lower = name.to_lowercase();
    let mut words = Vec::new();
    for piece in lower.split(|c: char| !c.is_ascii_alphanumeric()) {
        let mut rest = piece;
        while let Some(first) = rest.bytes().next() {
            let digits = first.is_ascii_digit();
            let end = rest.bytes().position(|b| b.is_ascii_digit() != digits).unwrap_or(rest.len());
            let (run, after) = rest.split_at(end);
            if digits {
                words.extend(run.parse().ok().map(Word::Number));
            } else {
                words.extend(cut(run));
            }
            rest = after;
        }
    }
    words
}

/// The fewest words of the vocabulary that make up `run`; none where they do not.
fn cut(run: &str) -> Vec<Word> {
    /// Longer runs are no names.
    const LONGEST: usize = 64;
    if run.len() > LONGEST {
        return Vec::new();
    }
    // For every length the shortest way to make up that much of the run.
    let mut ways: Vec<Option<Vec<usize>>> = vec![None; run.len() + 1];
    ways[0] = Some(Vec::new());
    for start in 0..run.len() {
        let Some(way) = ways[start].clone() else { continue };
        for (index, (word, _)) in WORDS.iter().enumerate() {
            if !run[start..].starts_with(word) {
                continue;
            }
            let end = &mut ways[start + word.len()];
            if end.as_ref().is_none_or(|known| known.len() > way.len() + 1) {
                let mut longer = way.clone();
                longer.push(index);
                *end = Some(longer);
            }
        }
    }
    let made = ways.pop().flatten().unwrap_or_default();
    made.into_iter().flat_map(|index| WORDS[index].1.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn landmark(name: &str) -> Option<usize> {
        place_by_name(name).map(|named| named.landmark)
    }

    #[test]
    fn names_of_studios() {
        for (name, wanted) in [
            ("ForeHead_M", 151),
            ("ForeHead_L", 333),
            ("Leyebrow_Inside", 336),
            ("Reyebrow_M", 105),
            ("Eyebrow_Center", 9),
            ("NoseTop", 168),
            ("NoseHead", 4),
            ("NoseHead_R", 129),
            ("Leye_Outside", 263),
            ("Rcheek_Down", 187),
            ("Mouth_UpL1", 269),
            ("Mouth_Lend", 291),
            ("Mouth_DownR", 181),
            ("Mouth_Up", 0),
            ("Chin_R2", 136),
            ("Chin_L1", 396),
            ("left mouth corner", 291),
            ("RightLipCorner", 61),
            ("Face:lower_lip", 17),
            ("upperLidL", 386),
            ("brow.inner.R", 107),
            ("LM_61", 61),
            ("landmark-291", 291),
            ("leftEyebrowOuter", 300),
        ] {
            assert_eq!(landmark(name), Some(wanted), "{name}");
        }
        for name in ["", "M001", "LFHD", "left_right_mouth", "Mouth", "Leye", "lm_470", "shoulder", "Мaркер"]
        {
            assert_eq!(landmark(name), None, "{name}");
        }
    }

    #[test]
    fn pairs_know_each_other() {
        let named = |name| place_by_name(name).unwrap();
        assert!(named("Mouth_Lend").mirrors(&named("Mouth_Rend")));
        assert!(named("Chin_L1").mirrors(&named("Chin_R1")));
        assert!(!named("Chin_L1").mirrors(&named("Chin_R2")));
        assert!(!named("Chin").mirrors(&named("Chin")));
    }
}
