//! Disjoint sets of numbers, joined one after the other.

/// Sets of the numbers 0..n; each is named by its least member.
pub struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// Every number by itself.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The least member of a number's set.
    pub fn least(&mut self, mut number: u32) -> u32 {
        while self.0[number as usize] != number {
            let above = self.0[self.0[number as usize] as usize];
            self.0[number as usize] = above;
            number = above;
        }
        number
    }

    /// Makes one set of two.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.least(a), self.least(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_joined_has_one_name() {
        let mut sets = DisjointSets::new(6);
        for (a, b) in [(4, 5), (1, 4), (2, 3)] {
            sets.join(a, b);
        }
        let names: Vec<u32> = (0..6).map(|n| sets.least(n)).collect();
        assert_eq!(names, [0, 1, 2, 2, 1, 1]);
    }
}
