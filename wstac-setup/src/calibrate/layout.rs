//! Computes the layout of the taxels from the bases: squares around them, as large a fraction of the pitch as in the
//! paper's layout.

use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::Layout;
use wstac_core::params::{PAPER_PITCH, PAPER_TAXEL_SIDE, TAXELS};

use super::named;
use wstac_host::source::StreamInfo;

/// Side of a taxel as a fraction of the pitch (paper).
const SHARE: f64 = PAPER_TAXEL_SIDE as f64 / PAPER_PITCH as f64;
/// Smallest fraction if the picture's edge leaves no more room: most of a spot.
const LEAST_SHARE: f64 = 0.45;

/// Returns taxels around `centers`, in pixels; whole numbers are the middle of a pixel.
///
/// Bayer formats have them on whole cells.
///
/// # Errors
/// A whisker is too close to the picture's edge for a taxel around it.
pub(super) fn layout(info: &StreamInfo, centers: &[[f64; 2]; TAXELS], pitch: [f64; 2]) -> Result<Layout, String> {
    let cell = f64::from(Any::new(info.format, info.color, YcbcrMethod::Exact).cell());
    let frame = [info.size.width(), info.size.height()].map(f64::from);
    let mut taxel = [0; 2];
    let mut corners = [[0; 2]; TAXELS];
    for k in 0..2 {
        // Pixels from a center to the nearest edge, less one cell for rounding.
        let room = |center: &[f64; 2]| (center[k] + 0.5).min(frame[k] - 0.5 - center[k]) - cell / 2.0;
        let (tightest, least) = (0..TAXELS)
            .map(|taxel| (taxel, room(&centers[taxel])))
            .fold((0, f64::INFINITY), |least, room| if room.1 < least.1 { room } else { least });
        let side = (SHARE * pitch[k]).min(2.0 * least);
        if side < LEAST_SHARE * pitch[k] {
            let (name, from) = (named(tightest), least.max(0.0));
            let needed = LEAST_SHARE * pitch[k] / 2.0;
            return Err(format!(
                "the whisker in {name} is {from:.0} pixels from the picture's edge, expected at least {needed:.0}"
            ));
        }
        let side = ((side / cell).round() * cell).max(cell);
        taxel[k] = side as u16;
        for (corner, center) in corners.iter_mut().zip(centers) {
            let nearest = ((center[k] - (side - 1.0) / 2.0) / cell).round() * cell;
            corner[k] = nearest.clamp(0.0, ((frame[k] - side) / cell).floor().max(0.0) * cell) as u16;
        }
    }
    Layout::new(info.size, taxel, corners).map_err(|error| error.to_string())
}
