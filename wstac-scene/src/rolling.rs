//! A rolling shutter: each row of pixels is exposed later than the one before it.
//!
//! The light of all whiskers is computed in parts of a frame, and summed over time. A taxel's light is that between the
//! moments at which its middle row starts and ends its exposure.

use std::collections::VecDeque;

use wstac_core::layout::Layout;
use wstac_core::params::TAXELS;

/// Parts of a frame. At 30 frames per second, a slide at 600 mm/s moves by 0.3 mm within one.
const PARTS: f64 = 64.0;

/// The light of the last frames, and when each taxel is exposed.
#[derive(Clone, Debug)]
pub(crate) struct RollingShutter {
    /// How much later than the first row each taxel is exposed, in s.
    late_s: [f64; TAXELS],
    /// The length of a part in s.
    part_s: f64,
    /// The light until the start of each part, and the number of the first of these parts.
    until: VecDeque<[f64; TAXELS]>,
    first: u64,
}

impl RollingShutter {
    /// Creates the shutter of a camera that reads its rows within `readout_s`, the last row first if that is below 0.
    pub(crate) fn new(readout_s: f64, frame_s: f64, layout: &Layout) -> Self {
        Self::with_parts(readout_s, frame_s, layout, PARTS)
    }

    fn with_parts(readout_s: f64, frame_s: f64, layout: &Layout, parts: f64) -> Self {
        let [height, side] = [layout.frame().height(), layout.taxel()[1]].map(f64::from);
        let late_s = layout.corners().map(|[_, top]| {
            let down = (f64::from(top) + 0.5 * side) / height;
            readout_s.abs() * if readout_s < 0.0 { 1.0 - down } else { down }
        });
        Self { late_s, part_s: frame_s / parts, until: VecDeque::from([[0.0; TAXELS]]), first: 0 }
    }

    /// Returns each taxel's light over `open` s from `from` s on, in its own row's time. Light is asked of `expose`
    /// from a time on and over a length, in s, without a gap from 0 on.
    pub(crate) fn expose(
        &mut self,
        from: f64,
        open: f64,
        mut expose: impl FnMut(f64, f64) -> [f64; TAXELS],
    ) -> [f64; TAXELS] {
        let end = from + open + self.late_s.iter().fold(0.0, |most: f64, late| most.max(*late));
        while let Some(&last) = self.until.back()
            && self.time_of(self.until.len() - 1) < end
        {
            let light = expose(self.time_of(self.until.len() - 1), self.part_s);
            self.until.push_back(core::array::from_fn(|taxel| last[taxel] + light[taxel]));
        }
        while self.until.len() > 2 && self.time_of(1) <= from {
            self.until.pop_front();
            self.first += 1;
        }
        core::array::from_fn(|taxel| {
            let start = from + self.late_s[taxel];
            self.light_until(taxel, start + open) - self.light_until(taxel, start)
        })
    }

    fn time_of(&self, index: usize) -> f64 {
        (self.first + index as u64) as f64 * self.part_s
    }

    /// Returns a taxel's light until a time; within a part it is even.
    fn light_until(&self, taxel: usize, time: f64) -> f64 {
        let at = (time / self.part_s - self.first as f64).max(0.0);
        let index = (at as usize).min(self.until.len().saturating_sub(2));
        let (Some(before), Some(behind)) = (self.until.get(index), self.until.get(index + 1)) else { return 0.0 };
        before[taxel] + (behind[taxel] - before[taxel]) * (at - index as f64).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use wstac_core::layout::FrameSize;
    use wstac_core::params::COLUMNS;

    use super::*;

    /// Checks that each taxel sees the light of its own row's time, whatever the parts are.
    #[test]
    fn a_taxel_is_exposed_in_its_rows_time() {
        let layout = Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap();
        let frame_s = 1.0 / 30.0;
        for (readout_s, open) in [(0.033, frame_s), (0.02, 0.008), (-0.02, frame_s)] {
            let mut shutters =
                [1.0, 2.0].map(|finer| RollingShutter::with_parts(readout_s, frame_s, &layout, finer * PARTS));
            for frame in 0..100 {
                let from = f64::from(frame) * frame_s;
                // The light grows with time: its integral over a stretch is exact.
                let lights = shutters.each_mut().map(|shutter| {
                    shutter.expose(from, open, |from, length| [from * length + 0.5 * length * length; TAXELS])
                });
                for taxel in 0..TAXELS {
                    let row = (40.0 + 80.0 * (taxel / COLUMNS) as f64) / 400.0;
                    let late = if readout_s < 0.0 { (1.0 - row) * -readout_s } else { row * readout_s };
                    let expected = open * (from + late + 0.5 * open);
                    for light in lights {
                        assert!((light[taxel] - expected).abs() < 1e-6, "{frame} {taxel}: {} {expected}", light[taxel]);
                    }
                }
            }
        }
    }
}
