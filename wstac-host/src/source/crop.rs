//! The part of a camera's frames around the taxels, of every pixel format.

use serde::{Deserialize, Serialize};
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{self, Any, YcbcrMethod};
use wstac_core::green::ycbcr::QuantizationRange;
use wstac_core::layout::{FrameSize, Layout};

use super::StreamInfo;

/// A rectangle of a frame. Pixels outside of it are not known.
///
/// Its left and top are even, and its right and bottom are even or at the edge of the frame. So mosaics and pairs of
/// pixels stay whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    /// Left and top in pixels of the frame.
    at: [u16; 2],
    size: FrameSize,
}

impl Crop {
    /// Returns the smallest rectangle that has all taxels of a layout and this many pixels around them.
    ///
    /// It ends at the edges of the frame. Sides are rounded up to even places.
    ///
    /// ```
    /// use wstac_core::layout::{FrameSize, Layout};
    /// use wstac_host::source::Crop;
    ///
    /// let layout = Layout::paper(FrameSize::new(1280, 720)?)?;
    /// let crop = Crop::around(&layout, 16);
    /// assert_eq!((crop.at(), crop.size()), ([290, 10], FrameSize::new(700, 700)?));
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub fn around(layout: &Layout, margin: u16) -> Self {
        let frame = [layout.frame().width(), layout.frame().height()];
        let span = |axis: usize| {
            let places = || layout.corners().iter().map(|corner| corner[axis]);
            let (first, last) = (places().min().unwrap_or(0), places().max().unwrap_or(0));
            let from = first.saturating_sub(margin) & !1;
            let to = last.saturating_add(layout.taxel()[axis]).saturating_add(margin).min(frame[axis]);
            (from, to.next_multiple_of(2).min(frame[axis]))
        };
        Self::between(span(0), span(1)).unwrap_or(Self { at: [0, 0], size: layout.frame() })
    }

    /// Returns the rectangle from one column and row to others; `None` if it is empty.
    fn between(columns: (u16, u16), rows: (u16, u16)) -> Option<Self> {
        let size = FrameSize::new(columns.1.checked_sub(columns.0)?.into(), rows.1.checked_sub(rows.0)?.into()).ok()?;
        Some(Self { at: [columns.0, rows.0], size })
    }

    /// Returns the left and the top in pixels of the frame.
    pub fn at(&self) -> [u16; 2] {
        self.at
    }

    /// Returns the width and the height.
    pub fn size(&self) -> FrameSize {
        self.size
    }

    /// Returns the columns and the rows behind the last.
    fn end(self) -> [u32; 2] {
        [u32::from(self.at[0]) + u32::from(self.size.width()), u32::from(self.at[1]) + u32::from(self.size.height())]
    }

    /// Returns the part that two rectangles have in common; `None` if there is none.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let span = |axis: usize| {
            let to = self.end()[axis].min(other.end()[axis]);
            (self.at[axis].max(other.at[axis]), to as u16)
        };
        Self::between(span(0), span(1))
    }

    /// Returns whether a frame of this size can have such a part.
    pub fn fits(&self, frame: FrameSize) -> bool {
        let ([right, bottom], whole) = (self.end(), [u32::from(frame.width()), u32::from(frame.height())]);
        let is_even = self.at.iter().all(|at| at % 2 == 0);
        is_even && [right, bottom].iter().zip(whole).all(|(&end, whole)| end == whole || (end < whole && end % 2 == 0))
    }

    /// Returns the first taxel of a layout that is not inside; `None` if all are.
    pub fn first_outside(&self, layout: &Layout) -> Option<usize> {
        let [width, height] = layout.taxel().map(u32::from);
        let [right, bottom] = self.end();
        layout.corners().iter().position(|&[x, y]| {
            x < self.at[0] || y < self.at[1] || u32::from(x) + width > right || u32::from(y) + height > bottom
        })
    }

    /// Returns the layout in pixels of the part; `None` if a taxel is not inside.
    pub fn layout(&self, layout: &Layout) -> Option<Layout> {
        let mut corners = *layout.corners();
        for [x, y] in &mut corners {
            (*x, *y) = (x.checked_sub(self.at[0])?, y.checked_sub(self.at[1])?);
        }
        Layout::new(self.size, layout.taxel(), corners).ok()
    }

    /// Returns the stream whose frames are the part alone, without padding.
    pub fn of_stream(&self, info: &StreamInfo) -> StreamInfo {
        let part = StreamInfo::new("", self.size, info.format, info.rate);
        StreamInfo { size: self.size, bytes_per_row: part.bytes_per_row, crop: None, ..info.clone() }
    }

    /// Cuts the part out of a frame. A frame that is too short gives no bytes.
    pub fn cut(&self, info: &StreamInfo, frame: &[u8], part: &mut Vec<u8>) {
        part.clear();
        let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
        if frame.len() < green.least_frame_bytes(info.size, info.bytes_per_row as usize) {
            return;
        }
        for (plane, of_part) in planes(info).into_iter().zip(planes(&self.of_stream(info))) {
            for row in 0..of_part.rows {
                let from = plane.place(self.at, row);
                let bytes = frame.get(from..).unwrap_or_default();
                let bytes = bytes.get(..of_part.step).unwrap_or(bytes);
                part.extend_from_slice(bytes);
                // The last row's padding may be missing.
                part.resize(part.len() + of_part.step - bytes.len(), 0);
            }
        }
    }

    /// Puts the part into a frame that is black otherwise. Bytes of another length give no frame.
    pub fn paste(&self, info: &StreamInfo, part: &[u8], frame: &mut Vec<u8>) {
        let of_part = planes(&self.of_stream(info));
        let bytes: usize = of_part.iter().map(|plane| plane.rows * plane.step).sum();
        if part.len() != bytes {
            frame.clear();
            return;
        }
        let whole = planes(info);
        if frame.is_empty() {
            for plane in &whole {
                let row = plane.black(info.color.range);
                (0..plane.rows).for_each(|_| frame.extend_from_slice(&row));
            }
        }
        let mut rest = part;
        for (plane, of_part) in whole.iter().zip(of_part) {
            for row in 0..of_part.rows {
                let (bytes, behind) = rest.split_at_checked(of_part.step).unwrap_or_default();
                rest = behind;
                let place = plane.place(self.at, row);
                if let Some(target) = frame.get_mut(place..place + bytes.len()) {
                    target.copy_from_slice(bytes);
                }
            }
        }
    }
}

struct Plane {
    /// The place of its first byte.
    start: usize,
    /// Bytes from row to row.
    step: usize,
    rows: usize,
    format: any::Plane,
}

impl Plane {
    /// Returns the place of a row of a part that starts at a pixel.
    fn place(&self, [x, y]: [u16; 2], row: usize) -> usize {
        let any::Plane { unit: [columns, rows], bytes } = self.format;
        let first = usize::from(y / rows);
        self.start + (first + row) * self.step + usize::from(x / columns) * bytes.len()
    }

    /// Returns a row of black pixels.
    fn black(&self, range: QuantizationRange) -> Vec<u8> {
        let black = self.format.bytes.iter().map(|byte| match byte {
            b'Y' if range == QuantizationRange::Full => 0,
            b'Y' => 16,
            b'U' | b'V' => 128,
            _ => 0,
        });
        black.cycle().take(self.step).collect()
    }
}

fn planes(info: &StreamInfo) -> Vec<Plane> {
    let (height, step) = (usize::from(info.size.height()), info.bytes_per_row as usize);
    let mut start = 0;
    let planes = info.format.facts().planes.iter().map(|&format| {
        let [columns, rows] = format.unit.map(usize::from);
        // Only planes of chroma have rows of another length than the first.
        let step = if start == 0 { step } else { (step * format.bytes.len()).div_ceil(columns) };
        let plane = Plane { start, step, rows: height.div_ceil(rows), format };
        start += plane.step * plane.rows;
        plane
    });
    planes.collect()
}

#[cfg(test)]
mod tests {
    use wstac_core::frame::Stride;
    use wstac_core::green::any::PixelFormat;
    use wstac_core::green::ycbcr::YcbcrEncoding;
    use wstac_core::params::TAXELS;
    use wstac_core::rate::FrameRate;
    use wstac_core::taxels::{FrameGeometry, TaxelSums};

    use super::*;

    /// Layouts whose taxels begin at odd places and end at the edges.
    fn layouts(frame: FrameSize) -> [Layout; 2] {
        let corners = core::array::from_fn(|k| [31 + 9 * (k % 5) as u16, 13 + 9 * (k / 5) as u16]);
        let mut at_the_edge = corners;
        at_the_edge[TAXELS - 1] = [frame.width() - 7, frame.height() - 5];
        [corners, at_the_edge].map(|corners| Layout::new(frame, [7, 5], corners).unwrap())
    }

    #[test]
    fn a_part_gives_the_sums_of_the_frame_in_every_format() {
        for (format, [width, height], padding) in PixelFormat::all()
            .flat_map(|format| [([100, 80], 0), ([101, 79], 6)].map(|(size, padding)| (format, size, padding)))
        {
            let size = FrameSize::new(width, height).unwrap();
            let mut info = StreamInfo::new("", size, format, FrameRate::NOMINAL);
            info.bytes_per_row += padding;
            let frame_bytes = info.frame_bytes();
            let frame: Vec<u8> = (0..frame_bytes).map(|at| (at * 37 % 251) as u8).collect();
            for (layout, margin) in layouts(size).into_iter().flat_map(|layout| [(layout, 0), (layout, 3)]) {
                let crop = Crop::around(&layout, margin);
                assert!(crop.fits(size) && crop.first_outside(&layout).is_none(), "{crop:?}");
                let (mut part, mut whole) = (Vec::new(), Vec::new());
                crop.cut(&info, &frame, &mut part);
                let of_part = crop.of_stream(&info);
                assert_eq!(part.len(), of_part.frame_bytes(), "{format:?} {crop:?}");
                crop.paste(&info, &part, &mut whole);
                assert_eq!(whole.len(), frame_bytes, "{format:?}");
                for (method, stride) in [(YcbcrMethod::Exact, Stride::One), (YcbcrMethod::Linear, Stride::Two)] {
                    let green = Any::new(format, YcbcrEncoding::default(), method);
                    let sums = |info: &StreamInfo, layout: &Layout, bytes: &[u8]| {
                        let geometry = FrameGeometry::with_stride(green, *layout, info.rate, stride).unwrap();
                        let geometry = geometry.with_bytes_per_row(info.bytes_per_row).unwrap();
                        TaxelSums::new(geometry).push_frame(bytes).unwrap()
                    };
                    let expected = sums(&info, &layout, &frame);
                    assert_eq!(sums(&info, &layout, &whole), expected, "{format:?} {size:?} {crop:?}");
                    // Other programs read the part with the layout that the recording states for it.
                    let inside = crop.layout(&layout).unwrap();
                    assert_eq!(sums(&of_part, &inside, &part), expected, "{format:?} {size:?} {crop:?}");
                }
            }
        }
    }

    #[test]
    fn a_frame_that_is_too_short_stays_too_short() {
        let size = FrameSize::new(100, 80).unwrap();
        let info = StreamInfo::new("", size, PixelFormat::Gray, FrameRate::NOMINAL);
        let crop = Crop::around(&layouts(size)[0], 2);
        let (mut part, mut whole) = (vec![1], vec![1]);
        crop.cut(&info, &[0; 7999], &mut part);
        crop.paste(&info, &part, &mut whole);
        assert_eq!((part.len(), whole.len()), (0, 0));
    }

    #[test]
    fn parts_that_do_not_fit_are_found() {
        let frame = FrameSize::new(100, 80).unwrap();
        let of = |at, width, height| Crop { at, size: FrameSize::new(width, height).unwrap() };
        assert!(of([0, 0], 100, 80).fits(frame) && of([2, 4], 10, 76).fits(frame));
        for crop in [of([1, 0], 9, 8), of([0, 0], 9, 8), of([92, 0], 10, 8), of([65534, 0], 100, 8), of([0, 2], 2, 80)]
        {
            assert!(!crop.fits(frame), "{crop:?}");
        }
        assert_eq!(of([0, 0], 10, 10).intersection(&of([4, 6], 10, 10)), Some(of([4, 6], 6, 4)));
        assert_eq!(of([0, 0], 10, 10).intersection(&of([10, 0], 10, 10)), None);
    }
}
