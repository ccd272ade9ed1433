//! Exact green of 32 or of 64 pixels at a time, in lanes of 16 bits.
//!
//! `simd::factors` explains the numbers. One instruction takes chroma out of packed bytes and multiplies it by 7 bits.
//! Two more multiply that by the high and by the low factors, and add up Cb and Cr.
//! A shuffle copies w, the high half of a lane of 32 bits, to both pixels of the cell.
//!
//! p · y + w fits 16 bits, and so does its quotient by 73: the high half of a product with 2^21 / 73, shifted right by
//! 5.
//! Two vectors are packed into one, which clamps to 0..=255, and the bytes are added up.
//!
//! The same text is compiled for AVX2 and for AVX-512, whose vectors are twice as wide.
//!
//! 32 pixels of YUYV take 25 instructions with AVX2, apart from loads. A YUYV frame of 1280 × 720 takes 5.2 % of the
//! plain code's time with AVX2 and 3.0 % with AVX-512. That is 28 % and 48 % of the speed of a plain read (one run on
//! an AMD EPYC of family 26, frame in the cache).

/// Defines the kernel for one width of vectors. The module around it gives the intrinsics names without their width.
macro_rules! kernel {
    ($feature:literal) => {
        use core::arch::x86_64::{__m128i, _mm_cvtsi32_si128};
        use core::hint::black_box;

        use crate::green::avx2::prefetch;
        use crate::green::simd::cells::{Bytes, Cells, Chroma, Row, Vectors, WithPairs, WithPlanes};
        use crate::green::simd::{BlockRows, Factors};

        /// Sums the green of cells.
        #[target_feature(enable = $feature)]
        pub(in crate::green::avx2) fn sum(cells: &Cells<'_>, factors: &Factors) -> u32 {
            if factors.luma == 1 { of_range::<false>(cells, factors) } else { of_range::<true>(cells, factors) }
        }

        #[inline]
        #[target_feature(enable = $feature)]
        fn of_range<const LIMITED: bool>(cells: &Cells<'_>, factors: &Factors) -> u32 {
            let lanes = Lanes::<LIMITED>::new(factors, cells.place());
            match cells.chroma {
                Chroma::Within(_) => of_rows::<Vectors<'_, VECTOR>, LIMITED>(&lanes, cells),
                Chroma::Pairs(..) => of_rows::<WithPairs<'_, HALF>, LIMITED>(&lanes, cells),
                Chroma::Planes(..) => of_rows::<WithPlanes<'_, CELLS, HALF>, LIMITED>(&lanes, cells),
            }
        }

        /// Sums rows of cells, of which some pixels of the first and of the last do not count.
        #[inline]
        #[target_feature(enable = $feature)]
        fn of_rows<'a, R: Row<'a, CELLS, HALF, VECTOR>, const LIMITED: bool>(
            lanes: &Lanes<LIMITED>,
            cells: &Cells<'a>,
        ) -> u32 {
            let (count, [left, right]) = (cells.in_row(), cells.outside);
            // Whole pairs of vectors, then one or two vectors of which the last ends with the row.
            let before = count.saturating_sub(1) / (2 * CELLS);
            let rest = count.saturating_sub(2 * CELLS * before);
            let old = (2 * CELLS).saturating_sub(rest) % CELLS;
            let in_rest = if before == 0 { left } else { 0 };
            let every = vector(&counted([0, 0], [0, 0]));
            let head = vector(&counted([left, 0], [0, 0]));
            let tail = vector(&if rest > CELLS {
                counted([in_rest, 0], [2 * old, right])
            } else {
                counted([2 * old + in_rest, right], [2 * CELLS, 0])
            });
            let mut sum = zero();
            let mut rows = BlockRows::new(cells.luma);
            for number in 0..cells.luma.rows() {
                let Some(row) = rows.next().and_then(|luma| R::new(cells, luma, number)) else { break };
                match (row.last(), cells.chroma) {
                    (Bytes::Packed(luma), _) => prefetch(luma, cells.luma, cells.luma.width()),
                    (Bytes::Pairs(luma, chroma), Chroma::Pairs(pairs, _)) => {
                        prefetch(luma, cells.luma, cells.luma.width());
                        prefetch(chroma, pairs, pairs.width());
                    }
                    (Bytes::Pairs(luma, _) | Bytes::Planes(luma, _), _) => {
                        prefetch(luma, cells.luma, cells.luma.width())
                    }
                }
                let mut counts = head;
                for index in 0..before {
                    let (Some(first), Some(second)) = (row.cells(2 * index), row.cells(2 * index + 1)) else { break };
                    sum = add(sum, [lanes.green(first), lanes.green(second)], counts);
                    counts = every;
                }
                let end = lanes.green(row.last());
                let green = match row.cells(2 * before) {
                    Some(first) if rest > CELLS => [lanes.green(first), end],
                    _ => [end, end],
                };
                sum = add(sum, green, tail);
            }
            // The sum is below 2^32, so the low halves of its 64-bit parts are enough.
            numbers(sum).iter().step_by(2).fold(0, |sum, part| sum.wrapping_add(*part))
        }

        /// Returns a mask of two packed vectors that leaves out some pixels at both ends of each.
        #[inline(always)]
        fn counted(first: [usize; 2], second: [usize; 2]) -> [u8; VECTOR] {
            // In bytes, of which the compiler makes vectors.
            let [first, second] =
                [first, second].map(|[left, right]| [left as u8, (2 * CELLS).saturating_sub(right) as u8]);
            // Packing takes eight pixels of the first vector, eight of the second, and again.
            core::array::from_fn(|index| {
                let pixel = (index / 16 * 8 + index % 8) as u8;
                let [from, to] = if index % 16 < 8 { first } else { second };
                if pixel >= from && pixel < to { u8::MAX } else { 0 }
            })
        }

        /// Clamps the green of two vectors of pixels to 0..=255 and adds those that count to 64-bit sums.
        #[inline]
        #[target_feature(enable = $feature)]
        fn add(sum: Vector, [first, second]: [Vector; 2], counts: Vector) -> Vector {
            let bytes = and(packus_epi16(first, second), counts);
            add_epi64(sum, sad_epu8(bytes, zero()))
        }

        /// [`Factors`] in all lanes. `LIMITED` means p/q = 85/73; otherwise it is 1.
        #[derive(Clone, Copy)]
        struct Lanes<const LIMITED: bool> {
            /// Takes luma out of packed bytes and multiplies it.
            luma: Vector,
            /// Takes chroma out of packed bytes and multiplies it.
            scale: Vector,
            high: Vector,
            low: Vector,
            offset: Vector,
            /// Copies each cell's w to both pixels.
            both: Vector,
            shift: __m128i,
            /// Multiplies luma that lies apart.
            words_luma: Vector,
            /// Multiplies chroma that lies apart.
            words_scale: Vector,
        }

        impl<const LIMITED: bool> Lanes<LIMITED> {
            /// `place` is that of luma in each pair of packed bytes.
            #[inline]
            #[target_feature(enable = $feature)]
            fn new(factors: &Factors, place: usize) -> Self {
                let pairs = |[cb, cr]: [i16; 2]| set1_epi32(i32::from(cb as u16) | i32::from(cr) << 16);
                let (luma, [cb, cr]) = (factors.luma, factors.scale);
                let (luma, scale) = if place == 0 {
                    ([luma, 0, luma, 0], [0, cb, 0, cr])
                } else {
                    ([0, luma, 0, luma], [cb, 0, cr, 0])
                };
                let packed = |bytes: [i8; 4]| set1_epi32(i32::from_le_bytes(bytes.map(|byte| byte as u8)));
                let both: [u8; VECTOR] = core::array::from_fn(|index| (index % 16 / 4 * 4 + 2 + index % 2) as u8);
                Self {
                    luma: packed(luma),
                    scale: packed(scale),
                    high: pairs(factors.high),
                    low: pairs(factors.low),
                    offset: set1_epi32(factors.offset),
                    // The compiler must not know these, or it makes two shuffles of one, and eight instructions of a
                    // product and a shift.
                    both: vector(black_box(&both)),
                    shift: _mm_cvtsi32_si128(black_box(5)),
                    words_luma: set1_epi16(i16::from(factors.luma)),
                    words_scale: pairs(factors.scale.map(i16::from)),
                }
            }

            /// Returns the green of pixels before it is clamped, in lanes of 16 bits.
            #[inline]
            #[target_feature(enable = $feature)]
            fn green(&self, cells: Bytes<'_, CELLS, HALF, VECTOR>) -> Vector {
                let (luma, chroma) = self.multiplied(cells);
                let high = add_epi32(madd_epi16(chroma, self.high), self.offset);
                let w = add_epi32(high, srai_epi32::<16>(madd_epi16(chroma, self.low)));
                let n = add_epi16(luma, shuffle_epi8(w, self.both));
                if LIMITED {
                    // ⌊n / 73⌋ of -32768..=32262, because 28729 · 73 = 2^21 + 65. Below 0 it is not above 0, which is
                    // enough.
                    sra_epi16(mulhi_epi16(n, set1_epi16(28_729)), self.shift)
                } else {
                    n
                }
            }

            /// Returns p · y of pixels and the scaled Cb, Cr pairs of their cells, in lanes of 16 bits.
            #[inline]
            #[target_feature(enable = $feature)]
            fn multiplied(&self, cells: Bytes<'_, CELLS, HALF, VECTOR>) -> (Vector, Vector) {
                let (luma, chroma) = match cells {
                    Bytes::Packed(bytes) => {
                        let bytes = vector(bytes);
                        return (maddubs_epi16(bytes, self.luma), maddubs_epi16(bytes, self.scale));
                    }
                    Bytes::Pairs(luma, chroma) => (half(luma), half(chroma)),
                    Bytes::Planes(luma, [cb, cr]) => (half(luma), interleaved(*cb, *cr)),
                };
                let (luma, chroma) = (cvtepu8_epi16(luma), cvtepu8_epi16(chroma));
                let luma = if LIMITED { mullo_epi16(luma, self.words_luma) } else { luma };
                (luma, mullo_epi16(chroma, self.words_scale))
            }
        }
    };
}

/// The kernel with vectors of 32 bytes.
pub(super) mod narrow {
    use core::arch::x86_64::{
        __m256i as Vector, _mm_cvtsi64_si128, _mm_unpacklo_epi8, _mm256_add_epi16 as add_epi16,
        _mm256_add_epi32 as add_epi32, _mm256_add_epi64 as add_epi64, _mm256_and_si256 as and,
        _mm256_cvtepu8_epi16 as cvtepu8_epi16, _mm256_madd_epi16 as madd_epi16, _mm256_maddubs_epi16 as maddubs_epi16,
        _mm256_mulhi_epi16 as mulhi_epi16, _mm256_mullo_epi16 as mullo_epi16, _mm256_packus_epi16 as packus_epi16,
        _mm256_sad_epu8 as sad_epu8, _mm256_set1_epi16 as set1_epi16, _mm256_set1_epi32 as set1_epi32,
        _mm256_setzero_si256 as zero, _mm256_shuffle_epi8 as shuffle_epi8, _mm256_sra_epi16 as sra_epi16,
        _mm256_srai_epi32 as srai_epi32,
    };

    use crate::green::avx2::{VECTOR, half, numbers, vector};

    const HALF: usize = VECTOR / 2;
    const CELLS: usize = VECTOR / 4;

    kernel!("avx2");

    /// Returns Cb and Cr in turn.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn interleaved(cb: [u8; CELLS], cr: [u8; CELLS]) -> __m128i {
        let [cb, cr] = [cb, cr].map(|bytes| _mm_cvtsi64_si128(i64::from_le_bytes(bytes)));
        _mm_unpacklo_epi8(cb, cr)
    }
}

/// The kernel with vectors of 64 bytes.
pub(super) mod wide {
    use core::arch::x86_64::{
        __m256i, __m512i as Vector, _mm_unpackhi_epi8, _mm_unpacklo_epi8, _mm256_set_m128i,
        _mm512_add_epi16 as add_epi16, _mm512_add_epi32 as add_epi32, _mm512_add_epi64 as add_epi64,
        _mm512_and_si512 as and, _mm512_cvtepu8_epi16 as cvtepu8_epi16, _mm512_madd_epi16 as madd_epi16,
        _mm512_maddubs_epi16 as maddubs_epi16, _mm512_mulhi_epi16 as mulhi_epi16, _mm512_mullo_epi16 as mullo_epi16,
        _mm512_packus_epi16 as packus_epi16, _mm512_sad_epu8 as sad_epu8, _mm512_set1_epi16 as set1_epi16,
        _mm512_set1_epi32 as set1_epi32, _mm512_setzero_si512 as zero, _mm512_shuffle_epi8 as shuffle_epi8,
        _mm512_sra_epi16 as sra_epi16, _mm512_srai_epi32 as srai_epi32,
    };

    use crate::green::avx2::{half as quarter, vector as half};

    const VECTOR: usize = 64;
    const HALF: usize = VECTOR / 2;
    /// Cells of a vector, and so of the narrowest row.
    pub(in crate::green::avx2) const CELLS: usize = VECTOR / 4;

    kernel!("avx512bw");

    /// Returns Cb and Cr in turn.
    #[inline]
    #[target_feature(enable = "avx512bw")]
    fn interleaved(cb: [u8; CELLS], cr: [u8; CELLS]) -> __m256i {
        let (cb, cr) = (quarter(&cb), quarter(&cr));
        _mm256_set_m128i(_mm_unpackhi_epi8(cb, cr), _mm_unpacklo_epi8(cb, cr))
    }

    #[inline]
    #[target_feature(enable = "avx512bw")]
    fn vector(bytes: &[u8; VECTOR]) -> Vector {
        // SAFETY: both types have 64 bytes, and any bits are valid in both.
        unsafe { core::mem::transmute(*bytes) }
    }

    /// Returns the sixteen 32-bit numbers of a vector.
    #[inline]
    #[target_feature(enable = "avx512bw")]
    fn numbers(vector: Vector) -> [u32; 16] {
        // SAFETY: both types have 64 bytes, and any bits are valid in both.
        unsafe { core::mem::transmute(vector) }
    }
}
