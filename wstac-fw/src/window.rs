//! The part of a frame that a camera interface has to capture: whole stripes of rows around the taxels.

use wstac_core::error::ConfigError;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::TAXELS;

/// The number of pixels, one byte each, of the words that camera interfaces capture.
const WORD: u16 = 4;

/// A window into a frame, and the taxels' positions in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    left: u16,
    top: u16,
    layout: Layout,
}

impl Window {
    /// Returns the smallest window around the taxels that is whole words wide and whole stripes of `rows` rows high.
    ///
    /// # Errors
    /// Returns [`ConfigError::TaxelOutside`] if the frame, rounded down to whole words and whole stripes, does not hold
    /// the taxels. A frame whose width is a multiple of 4 and whose height is a multiple of `rows` always does. Returns
    /// [`ConfigError::FrameSize`] if `rows` is 0.
    pub const fn around(layout: &Layout, rows: u16) -> Result<Self, ConfigError> {
        let (frame, taxel, corners) = (layout.frame(), layout.taxel(), layout.corners());
        let (mut least, mut end) = ([u16::MAX; 2], [0; 2]);
        let mut k = 0;
        while k < TAXELS {
            let mut axis = 0;
            while axis < 2 {
                let (first, after) = (corners[k][axis], corners[k][axis] + taxel[axis]);
                least[axis] = if first < least[axis] { first } else { least[axis] };
                end[axis] = if after > end[axis] { after } else { end[axis] };
                axis += 1;
            }
            k += 1;
        }
        if rows == 0 {
            return Err(ConfigError::FrameSize { width: frame.width() as u32, height: 0 });
        }
        let (left, width) = span(least[0], end[0], frame.width(), WORD);
        let (top, height) = span(least[1], end[1], frame.height(), rows);
        let mut shifted = *corners;
        k = 0;
        while k < TAXELS {
            shifted[k] = [shifted[k][0] - left, shifted[k][1] - top];
            k += 1;
        }
        let size = match FrameSize::new(width as u32, height as u32) {
            Ok(size) => size,
            Err(error) => return Err(error),
        };
        match Layout::new(size, taxel, shifted) {
            Ok(layout) => Ok(Self { left, top, layout }),
            Err(error) => Err(error),
        }
    }

    /// Returns the number of columns left of the window.
    pub const fn left(&self) -> u16 {
        self.left
    }

    /// Returns the number of rows above the window.
    pub const fn top(&self) -> u16 {
        self.top
    }

    /// Returns the width of the window in pixels, a multiple of 4.
    pub const fn width(&self) -> u16 {
        self.layout.frame().width()
    }

    /// Returns the height of the window in rows, whole stripes.
    pub const fn height(&self) -> u16 {
        self.layout.frame().height()
    }

    /// Returns the layout of the taxels in the window, as if it were the frame.
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }
}

/// Returns the first pixel and length of a multiple of `unit` that covers `least..end`, moved back if it would leave
/// the frame.
const fn span(least: u16, end: u16, frame: u16, unit: u16) -> (u16, u16) {
    let most = frame - frame % unit;
    let wanted = (end - least).div_ceil(unit) as u32 * unit as u32;
    let length = if wanted < most as u32 { wanted as u16 } else { most };
    let latest = frame - length;
    (if least < latest { least } else { latest }, length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(width: u32, height: u32) -> Layout {
        Layout::paper(FrameSize::new(width, height).unwrap()).unwrap()
    }

    #[test]
    fn taxels_keep_their_place_in_every_frame_of_whole_words_and_stripes() {
        for (width, height) in [(320, 240), (640, 480), (160, 120), (400, 400), (1280, 720), (240, 320), (8, 8)] {
            for rows in [1, 2, 4, 8, 16].into_iter().filter(|&rows| u32::from(rows) <= height) {
                let whole = layout(width, height);
                let window = Window::around(&whole, rows).unwrap();
                assert_eq!((window.width() % 4, window.height() % rows), (0, 0), "{width}x{height}, {rows} rows");
                assert!(u32::from(window.left() + window.width()) <= width);
                assert!(u32::from(window.top() + window.height()) <= height);
                for (shifted, corner) in window.layout().corners().iter().zip(whole.corners()) {
                    assert_eq!([shifted[0] + window.left(), shifted[1] + window.top()], *corner);
                }
                assert_eq!(window.layout().taxel(), whole.taxel());
            }
        }
    }

    #[test]
    fn a_window_is_no_larger_than_it_must_be() {
        // 320 x 240: taxels of 30 pixels from (49, 9) to (271, 231), 222 pixels each way.
        for rows in [8, 16] {
            let window = Window::around(&layout(320, 240), rows).unwrap();
            assert_eq!((window.left(), window.width(), window.top(), window.height()), (49, 224, 9, 224));
        }
    }

    #[test]
    fn a_window_at_the_edge_moves_inside() {
        let corners = [[310, 230]; TAXELS];
        let whole = Layout::new(FrameSize::new(320, 240).unwrap(), [10, 10], corners).unwrap();
        let window = Window::around(&whole, 8).unwrap();
        assert_eq!((window.left(), window.width(), window.top(), window.height()), (308, 12, 224, 16));
        assert_eq!(window.layout().corners()[0], [2, 6]);
    }

    #[test]
    fn a_frame_that_no_whole_window_fits_is_refused() {
        let corners = [[0, 0]; TAXELS];
        let odd = Layout::new(FrameSize::new(322, 240).unwrap(), [322, 10], corners).unwrap();
        assert!(matches!(Window::around(&odd, 8), Err(ConfigError::TaxelOutside { .. })));
        assert!(matches!(Window::around(&odd, 0), Err(ConfigError::FrameSize { height: 0, .. })));
    }
}
