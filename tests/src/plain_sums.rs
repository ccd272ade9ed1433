//! Taxel sums pixel by pixel, directly from SPEC §1: slow, in exact fractions, and without any code of the product.

use wstac_core::green::any::{PixelFormat, YcbcrMethod};
use wstac_core::green::bayer::BayerOrder;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};

/// The format of a picture and the places of its taxels.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixel format.
    pub format: PixelFormat,
    /// The encoding of YCbCr numbers.
    pub color: YcbcrEncoding,
    /// The method from YCbCr to green.
    pub method: YcbcrMethod,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Bytes from row to row (of luma).
    pub bytes_per_row: usize,
    /// The stride in pixels (Bayer: cells).
    pub stride: usize,
    /// Width and height of a taxel.
    pub taxel: [usize; 2],
    /// Left and top of each taxel.
    pub corners: [[usize; 2]; 25],
}

/// One pixel, as in the bytes.
#[derive(Clone, Copy)]
enum Pixel {
    Green(u64),
    /// A red or blue site of a mosaic.
    NotGreen,
    Ycbcr([u8; 3]),
}

/// Returns the smallest number of bytes of a row of `width` pixels.
///
/// # Panics
/// The format is not known here.
pub fn row_bytes(format: PixelFormat, width: usize) -> usize {
    use PixelFormat as F;
    match format {
        F::Gray | F::Bayer8(_) | F::Yu12 | F::Yuv422p | F::Yuv444p => width,
        F::Y10 | F::Y12 | F::Y16 | F::Rgb565 | F::Bayer10(_) | F::Bayer12(_) => 2 * width,
        F::Rgb24 | F::Bgr24 => 3 * width,
        F::Rgbx32 | F::Xrgb32 => 4 * width,
        F::Yuyv | F::Uyvy => 4 * width.div_ceil(2),
        F::Nv12 => 2 * width.div_ceil(2),
        _ => panic!("{format:?} has no plain sums, expected them for every format"),
    }
}

/// Returns the full scale of green.
pub fn full_scale(format: PixelFormat) -> u64 {
    match format {
        PixelFormat::Y10 | PixelFormat::Bayer10(_) => 1023,
        PixelFormat::Y12 | PixelFormat::Bayer12(_) => 4095,
        PixelFormat::Y16 => 65_535,
        _ => 255,
    }
}

impl Picture {
    /// Returns the smallest number of bytes of the whole picture; padding after the last row of a packed format is not
    /// needed.
    pub fn bytes(&self) -> usize {
        let luma = self.bytes_per_row * self.height;
        match self.format {
            PixelFormat::Nv12 => luma + self.bytes_per_row * self.height.div_ceil(2),
            PixelFormat::Yu12 => luma + 2 * self.bytes_per_row.div_ceil(2) * self.height.div_ceil(2),
            PixelFormat::Yuv422p => luma + 2 * self.bytes_per_row.div_ceil(2) * self.height,
            PixelFormat::Yuv444p => 3 * luma,
            _ => luma - self.bytes_per_row + row_bytes(self.format, self.width),
        }
    }

    /// Returns the number of counted pixels of a taxel, and the 25 sums. No taxel may be smaller than a cell.
    pub fn sums(&self, bytes: &[u8]) -> (u64, [u64; 25]) {
        let bayer = matches!(self.format, PixelFormat::Bayer8(_) | PixelFormat::Bayer10(_) | PixelFormat::Bayer12(_));
        let cell = if bayer { 2 } else { 1 };
        let snap = |x: usize| x / cell * cell;
        let [width, height] = self.taxel.map(snap);
        let mut pixels = 0;
        let sums = self.corners.map(|[left, top]| {
            let mut gathered = Gathered::default();
            for dy in (0..height).filter(|dy| dy / cell % self.stride == 0) {
                for dx in (0..width).filter(|dx| dx / cell % self.stride == 0) {
                    gathered.add(self.pixel(bytes, snap(left) + dx, snap(top) + dy), self.color);
                }
            }
            pixels = gathered.pixels;
            match self.method {
                YcbcrMethod::Linear if gathered.ycbcr => gathered.linear(self.color),
                _ => gathered.green,
            }
        });
        (pixels, sums)
    }

    fn pixel(&self, bytes: &[u8], x: usize, y: usize) -> Pixel {
        use PixelFormat as F;
        let row = y * self.bytes_per_row;
        let luma_bytes = self.bytes_per_row * self.height;
        let word = |at: usize| u64::from(bytes[at]) | u64::from(bytes[at + 1]) << 8;
        let full_scale = full_scale(self.format);
        let site = |order: BayerOrder, green: u64| {
            let first_is_green = matches!(order, BayerOrder::Grbg | BayerOrder::Gbrg);
            if (x + y).is_multiple_of(2) == first_is_green {
                Pixel::Green(green.min(full_scale))
            } else {
                Pixel::NotGreen
            }
        };
        let half_row = self.bytes_per_row.div_ceil(2);
        match self.format {
            F::Gray => Pixel::Green(u64::from(bytes[row + x])),
            F::Y10 | F::Y12 | F::Y16 => Pixel::Green(word(row + 2 * x).min(full_scale)),
            F::Rgb24 | F::Bgr24 => Pixel::Green(u64::from(bytes[row + 3 * x + 1])),
            F::Rgbx32 => Pixel::Green(u64::from(bytes[row + 4 * x + 1])),
            F::Xrgb32 => Pixel::Green(u64::from(bytes[row + 4 * x + 2])),
            F::Rgb565 => {
                let green = word(row + 2 * x) / 32 % 64;
                Pixel::Green(green * 4 + green / 16)
            }
            F::Bayer8(order) => site(order, u64::from(bytes[row + x])),
            F::Bayer10(order) | F::Bayer12(order) => site(order, word(row + 2 * x)),
            F::Yuyv => {
                let pair = row + x / 2 * 4;
                Pixel::Ycbcr([bytes[pair + x % 2 * 2], bytes[pair + 1], bytes[pair + 3]])
            }
            F::Uyvy => {
                let pair = row + x / 2 * 4;
                Pixel::Ycbcr([bytes[pair + x % 2 * 2 + 1], bytes[pair], bytes[pair + 2]])
            }
            F::Nv12 => {
                let pair = luma_bytes + y / 2 * self.bytes_per_row + x / 2 * 2;
                Pixel::Ycbcr([bytes[row + x], bytes[pair], bytes[pair + 1]])
            }
            F::Yu12 => {
                let (cb, plane) = (luma_bytes + y / 2 * half_row + x / 2, half_row * self.height.div_ceil(2));
                Pixel::Ycbcr([bytes[row + x], bytes[cb], bytes[cb + plane]])
            }
            F::Yuv422p => {
                let (cb, plane) = (luma_bytes + y * half_row + x / 2, half_row * self.height);
                Pixel::Ycbcr([bytes[row + x], bytes[cb], bytes[cb + plane]])
            }
            F::Yuv444p => Pixel::Ycbcr([0, 1, 2].map(|plane| bytes[plane * luma_bytes + row + x])),
            format => panic!("{format:?} has no plain sums, expected them for every format"),
        }
    }
}

/// The sums of the pixels of a taxel.
#[derive(Default)]
struct Gathered {
    pixels: u64,
    green: u64,
    ycbcr: bool,
    sums: [i128; 3],
}

impl Gathered {
    fn add(&mut self, pixel: Pixel, color: YcbcrEncoding) {
        match pixel {
            Pixel::Green(green) => self.green += green,
            Pixel::NotGreen => return,
            Pixel::Ycbcr(ycbcr) => {
                self.ycbcr = true;
                let one = ycbcr.map(i128::from);
                self.green += green_of(one, 1, color);
                for (sum, sample) in self.sums.iter_mut().zip(one) {
                    *sum += sample;
                }
            }
        }
        self.pixels += 1;
    }

    fn linear(&self, color: YcbcrEncoding) -> u64 {
        green_of(self.sums, i128::from(self.pixels), color)
    }
}

/// Returns the green of the sums of Y, Cb, Cr over `pixels` pixels, to the nearest integer (ties round up), within
/// 0..=255 · pixels.
///
/// With the definition of Y, Y = Kr R + Kg G + Kb B, and R = Y + 2 (1 − Kr) Cr, B = Y + 2 (1 − Kb) Cb.
///
/// # Panics
/// The matrix is not known here.
pub fn green_of([y, cb, cr]: [i128; 3], pixels: i128, color: YcbcrEncoding) -> u64 {
    // Kr, Kg, Kb in units of 1/10000.
    let (kr, kg, kb) = match color.matrix {
        YcbcrMatrix::Bt601 => (2990, 5870, 1140),
        YcbcrMatrix::Bt709 => (2126, 7152, 722),
        matrix => panic!("{matrix:?} has no plain sums, expected them for every matrix"),
    };
    let (black, luma_span, chroma_span) = match color.range {
        QuantizationRange::Limited => (16, 219, 224),
        QuantizationRange::Full => (0, 255, 255),
    };
    // Y, Cb, Cr as fractions of full scale over the common denominator luma_span · chroma_span · 10000.
    let unit = luma_span * chroma_span * 10_000;
    let y = (y - black * pixels) * chroma_span * 10_000;
    let cb = (cb - 128 * pixels) * luma_span * 10_000;
    let cr = (cr - 128 * pixels) * luma_span * 10_000;
    let red = y * 10_000 + 2 * (10_000 - kr) * cr;
    let blue = y * 10_000 + 2 * (10_000 - kb) * cb;
    // Kg G = Y − Kr R − Kb B, over unit · 10000 · 10000.
    let kg_green = y * 10_000 * 10_000 - kr * red - kb * blue;
    let denominator = kg * 10_000 * unit;
    let green = (2 * 255 * kg_green + denominator).div_euclid(2 * denominator);
    green.clamp(0, 255 * pixels) as u64
}
