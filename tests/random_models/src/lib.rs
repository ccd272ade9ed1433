//! Random model files of every kind, with extremes. They are made as the pages of `wstac-core` describe them, without
//! the writer of the host.
//!
//! This crate needs no allocation and no other crate. The unit tests of `wstac-core` and the emulated board make the
//! same models and samples. All answers together are one number, [`ANSWERS`]. The random numbers are made here, because
//! a board has no simulator.
#![no_std]

/// The inputs of a model: ten features in each of 70 frames.
pub const INPUTS: usize = 700;
/// The largest number of words of a model.
pub const MOST_WORDS: usize = 16_384;
/// The number of kinds of models: linear ones by weights and votes, forests, boosted trees by leaves, linear ones of
/// int32, and networks by weights.
pub const KINDS: u32 = 11;
/// The number of models of each kind in [`answers`].
pub const ROUNDS: u64 = 40;
/// The number of samples for each model.
pub const SAMPLES: usize = 12;
/// The result of [`answers`] on every machine.
pub const ANSWERS: u32 = 2_125_047_619;

/// Makes model files.
pub struct Maker {
    halves: [u16; 2 * MOST_WORDS],
    length: usize,
    chance: u64,
    inputs: u64,
    classes: u16,
    shift: u32,
    /// The places of entries in the table of leaves.
    entries: [u16; 3],
    leaves: Leaves,
    crc: fn(&[u32]) -> u32,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Leaves {
    Votes,
    Integers,
    Floats,
}

/// Returns a generator of 31 random bits, the same in every test.
pub fn numbers() -> impl FnMut() -> u32 {
    let mut chance = 1_u64;
    move || {
        chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (chance >> 33) as u32
    }
}

impl Maker {
    /// Creates a maker of models. `crc` computes the checksum of a model file's words: `wstac_core::model::file::crc`.
    // A board has room on its stack, and no heap.
    #[allow(clippy::large_stack_arrays)]
    pub const fn new(crc: fn(&[u32]) -> u32) -> Self {
        Self {
            halves: [0; 2 * MOST_WORDS],
            length: 0,
            chance: 0,
            inputs: 700,
            classes: 1,
            shift: 0,
            entries: [0; 3],
            leaves: Leaves::Votes,
            crc,
        }
    }

    fn below(&mut self, end: u64) -> u64 {
        self.chance = self.chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.chance >> 33) % end
    }

    fn push(&mut self, half: u16) {
        self.halves[self.length] = half;
        self.length += 1;
    }

    fn push_long(&mut self, long: u32) {
        self.push(long as u16);
        self.push((long >> 16) as u16);
    }

    /// Returns a number that is extreme half of the time. Small numbers meet thresholds exactly.
    fn number(&mut self) -> i16 {
        match self.below(4) {
            0 => self.below(7) as i16 - 3,
            1 => [i16::MIN, i16::MIN + 1, i16::MAX, -1][self.below(4) as usize],
            _ => self.below(65_536) as i16,
        }
    }

    /// Writes a model file of a kind to `words`, and returns its length in words.
    pub fn model(&mut self, kind: u32, seed: u64, words: &mut [u32]) -> usize {
        self.chance = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(kind) << 7;
        self.length = 0;
        (0..16).for_each(|_| self.push(0));
        let frames = [1, 2, 3, 35, 69, 70, 70, 70][self.below(8) as usize];
        self.inputs = 10 * frames;
        self.classes = match kind {
            2 | 3 => 2 + self.below(5) as u16,
            _ => 1 + self.below(20) as u16,
        };
        self.shift = [0, 0, 0, 1, 3][self.below(5) as usize];
        let (kind, number, trees) = match kind {
            0..=3 => self.linear([2, 1][kind as usize % 2], kind >= 2),
            4 => self.forest(),
            5 => self.boosted(Leaves::Integers),
            6 => self.boosted(Leaves::Floats),
            7 => self.linear(4, false),
            _ => self.network([2, 1, 4][kind as usize - 8]),
        };
        let labels = self.length;
        // Labels of one letter, which a byte counts, and no facts.
        (0..self.classes).for_each(|class| self.push(1 | (u16::from(b'a') + class) << 8));
        self.push(0);
        if self.length % 2 == 1 {
            self.push(0);
        }
        // Weights of int32 and networks are of the second layout.
        let layout = if kind == 5 || number == 4 { 0x324D } else { 0x314D };
        let header = [0x5357, layout, 0, 0, (self.length / 2) as u16, 0, kind, number, self.classes, 0, frames as u16];
        self.halves[..11].copy_from_slice(&header);
        self.halves[11] = trees;
        self.halves[12] = labels as u16;
        self.halves[14] = self.shift as u16;
        let (halves, _) = self.halves[..self.length].as_chunks::<2>();
        for (word, half) in words.iter_mut().zip(halves) {
            *word = u32::from(half[0]) | u32::from(half[1]) << 16;
        }
        let length = halves.len();
        words[1] = (self.crc)(&words[..length]);
        length
    }

    fn linear(&mut self, number: u16, pairs: bool) -> (u16, u16, u16) {
        self.shift = 0;
        let classes = self.classes;
        let one = classes == 2 && self.below(2) == 0;
        let rows = if pairs {
            classes * (classes - 1) / 2
        } else if one {
            1
        } else {
            classes
        };
        self.push(rows);
        self.push(0);
        self.rows(rows, self.inputs, number, 1 << 62);
        (if pairs { 2 } else { 1 }, number, 0)
    }

    fn network(&mut self, number: u16) -> (u16, u16, u16) {
        self.shift = 0;
        let hidden = 1 + self.below(2) as u16;
        self.push(hidden + 1);
        self.push(0);
        let mut inputs = self.inputs;
        for _ in 0..hidden {
            let (sums, shift) = (1 + self.below(20) as u16, self.below(30) as u16);
            self.push(sums);
            self.push(shift);
            self.rows(sums, inputs, number, 1 << 40);
            inputs = u64::from(sums).next_multiple_of(10);
        }
        let sums = if self.classes == 2 && self.below(2) == 0 { 1 } else { self.classes };
        self.push(sums);
        self.push(0);
        self.rows(sums, inputs, number, 1 << 62);
        (5, number, 0)
    }

    fn rows(&mut self, rows: u16, inputs: u64, number: u16, most_bias: i64) {
        let int8 = number == 1;
        let extreme = self.below(3);
        // A row of int32 is two of int16, whose biases are smaller.
        let (rows, most_bias) = if number == 4 { (2 * rows, most_bias.min(1 << 46)) } else { (rows, most_bias) };
        for _ in 0..rows {
            let bias: i64 =
                [0, most_bias, -most_bias, 1 << 31, -5][if extreme == 0 { 0 } else { self.below(5) as usize }];
            (0..4).for_each(|half| self.push((bias >> (16 * half)) as u16));
        }
        let row = if int8 { inputs.div_ceil(4) * 2 } else { inputs };
        let smallness = self.below(4);
        for _ in 0..u64::from(rows) * row {
            let weight = match (extreme, smallness) {
                (0, _) => [0x8000, 0x7FFF, 0x8080, 0x7F7F][smallness as usize],
                // All weights of a row together may fit into 32 bits.
                (_, 0) => self.below(3) as u16 | (self.below(3) as u16) << 8 & if int8 { 0xFFFF } else { 0 },
                _ => self.number() as u16,
            };
            self.push(weight);
        }
    }

    fn forest(&mut self) -> (u16, u16, u16) {
        self.leaves = Leaves::Votes;
        let unit = [1, 6, 1 << 24][self.below(3) as usize];
        self.push_long(unit);
        self.push_long(0);
        let table = self.length;
        for entry in 0..3 {
            self.entries[entry] = (self.length - table) as u16;
            let shares = 1 + self.below(2.min(self.classes.into())) as u16;
            self.push(shares);
            for share in 0..shares {
                let class = self.below(self.classes.into()) as u16;
                self.push(class);
                self.push_long(if share == 0 { unit / shares as u32 } else { unit / 3 });
            }
        }
        self.halves[18] = (self.length - table) as u16;
        let trees = 1 + self.below(60) as u16;
        self.trees(trees);
        (3, 0, trees)
    }

    fn boosted(&mut self, leaves: Leaves) -> (u16, u16, u16) {
        self.leaves = leaves;
        let scores = if self.classes == 2 && self.below(2) == 0 { 1 } else { self.classes };
        self.push(scores);
        self.push_start();
        let each = self.below(9) as u16;
        for _ in 0..scores {
            self.push(each);
            self.push_start();
        }
        self.trees(scores * each);
        (4, if leaves == Leaves::Floats { 3 } else { 2 }, scores * each)
    }

    /// Appends the score that sums start with.
    fn push_start(&mut self) {
        let number = self.number();
        self.push_long(if self.leaves == Leaves::Floats {
            f32::from(number).to_bits()
        } else {
            i32::from(number).cast_unsigned()
        });
    }

    fn trees(&mut self, count: u16) {
        for _ in 0..count {
            let at = self.length;
            self.push(0);
            let depth = self.below(7) as u32;
            self.node(depth);
            self.pad(at + 1);
            self.halves[at] = ((self.length - at - 1) >> self.shift) as u16;
        }
    }

    /// Pads to a whole number of units after the place `from`.
    fn pad(&mut self, from: usize) {
        while !(self.length - from).is_multiple_of(1 << self.shift) {
            self.push(0xAAAA);
        }
    }

    fn node(&mut self, depth: u32) {
        let at = self.length;
        let (input, threshold) = (self.below(self.inputs) as u16, self.number());
        self.push(input);
        self.push(threshold as u16);
        match if depth == 0 { 4 } else { self.below(5) } {
            side @ 0..2 => {
                let flag = if side == 0 { 1 << 15 } else { 1 << 14 };
                if self.leaves == Leaves::Votes {
                    let class = self.below(u64::from(self.classes.min(16))) as u16;
                    self.halves[at] |= flag | class << 10;
                } else {
                    self.halves[at] |= flag;
                    self.leaf();
                }
                self.node(depth - 1);
            }
            2 | 3 => {
                self.push(0);
                self.node(depth - 1);
                self.pad(at);
                self.halves[at + 2] = ((self.length - at) >> self.shift) as u16;
                self.node(depth - 1);
            }
            _ => {
                self.halves[at] |= 3 << 14;
                match if self.leaves == Leaves::Votes { self.below(3) } else { 0 } {
                    1 => {
                        self.halves[at] |= 1 << 13;
                        let (left, right) = (self.vote(), self.vote());
                        self.push(left | right << 8);
                    }
                    2 => {
                        self.halves[at] |= 1 << 12;
                        self.halves[at + 1] = self.vote();
                    }
                    _ => (0..2).for_each(|_| self.leaf()),
                }
            }
        }
    }

    fn leaf(&mut self) {
        match self.leaves {
            Leaves::Votes => {
                let vote = self.vote();
                self.push(vote);
            }
            Leaves::Integers => {
                let number = self.number();
                self.push(number as u16);
            }
            Leaves::Floats => {
                // The order in which they are added matters.
                let number = f32::from(self.number()) * [1.0, 1.0 / 3.0, 1e9, 1e-42][self.below(4) as usize];
                self.push_long(number.to_bits());
            }
        }
    }

    /// Returns a class, or sometimes one of the entries.
    fn vote(&mut self) -> u16 {
        let class = self.below(u64::from(self.classes)) as u16;
        if self.below(4) == 0 { self.classes + self.entries[usize::from(class) % 3] } else { class }
    }

    /// Returns a sample of full range, or one near the thresholds.
    pub fn sample(&mut self) -> [i16; INPUTS] {
        let style = self.below(5);
        [(); INPUTS].map(|()| match style {
            0 => i16::MIN,
            1 => i16::MAX,
            2 => self.below(9) as i16 - 4,
            3 => self.below(65_536) as i16,
            _ => self.number(),
        })
    }
}

/// Returns the answers of all models to their samples as one number. `answer` gives the class of each sample by the
/// model of these words. If it returns `None` because a model was refused, everything ends.
pub fn answers(
    maker: &mut Maker,
    words: &mut [u32],
    mut answer: impl FnMut(&[u32], &[[i16; INPUTS]; SAMPLES]) -> Option<[u8; SAMPLES]>,
) -> Option<u32> {
    let mut all = 0_u32;
    for round in 0..ROUNDS {
        for kind in 0..KINDS {
            let length = maker.model(kind, round, words);
            let samples = [(); SAMPLES].map(|()| maker.sample());
            for class in answer(words.get(..length)?, &samples)? {
                all = all.wrapping_mul(31).wrapping_add(class.into());
            }
        }
    }
    Some(all)
}
