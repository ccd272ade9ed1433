//! Measures the taxel sums of a 400 × 400 GREY frame in stripes, by the core and by plain loops over the bytes of the
//! taxels.

use wstac_core::error::Error;
use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::{FrameGeometry, TaxelSums};
use wstac_fw::emulated::clock::Clock;
use wstac_fw::emulated::host;

use crate::{ROWS, STRIPE};

const SIDE: usize = 400;

unsafe extern "C" {
    /// Sums with a plain loop in C.
    fn peer_sums(
        stripe: *const u8,
        first: u32,
        rows: u32,
        width: u32,
        corners: *const [u16; 2],
        taxel: *const u16,
        sums: *mut u32,
    );
}

/// Adds the bytes of a stripe to the sums of their taxels. The stripe starts at row `first` of the frame.
#[inline(never)]
fn plain(stripe: &[u8], first: usize, layout: &Layout, sums: &mut [u32; TAXELS]) {
    let [width, height] = layout.taxel().map(usize::from);
    for (y, row) in (first..).zip(stripe.chunks_exact(SIDE)) {
        for (sum, corner) in sums.iter_mut().zip(layout.corners()) {
            let [x, top] = corner.map(usize::from);
            if y >= top && y < top + height {
                *sum += row[x..x + width].iter().map(|&byte| u32::from(byte)).sum::<u32>();
            }
        }
    }
}

/// Measures the core and both loops on the same stripes. Their sums must be equal.
pub fn measure(clock: &Clock, stripe: &[u8; STRIPE]) -> Result<(), Error> {
    let layout = Layout::paper(FrameSize::new(SIDE as u32, SIDE as u32)?)?;
    let mut accumulators = TaxelSums::new(FrameGeometry::new(Gray, layout, FrameRate::NOMINAL)?);
    let [mut of_core, mut in_rust, mut in_c] = [[0; TAXELS]; 3];
    let mut ticks = [0; 3];
    let corners = *layout.corners();
    let taxel = layout.taxel();
    for first in (0..SIDE).step_by(ROWS) {
        // Every stripe gets another part of the bytes.
        let stripe = &stripe[first..first + ROWS * SIDE];
        let (took, done) = clock.ticks(|| accumulators.push_stripe(stripe));
        ticks[0] += u64::from(took);
        of_core = done?.unwrap_or(of_core);
        ticks[1] += u64::from(clock.ticks(|| plain(stripe, first, &layout, &mut in_rust)).0);
        // SAFETY: the peer reads the stripe's rows, the corners and the side lengths, and writes 25 sums.
        let in_c = || unsafe {
            peer_sums(
                stripe.as_ptr(),
                first as u32,
                ROWS as u32,
                SIDE as u32,
                corners.as_ptr(),
                taxel.as_ptr(),
                in_c.as_mut_ptr(),
            );
        };
        ticks[2] += u64::from(clock.ticks(in_c).0);
    }
    if of_core != in_rust || of_core != in_c {
        host::fail("sums differ\n");
    }
    for (name, ticks) in ["wstac-core", "plain loop, Rust", "plain loop, C"].into_iter().zip(ticks) {
        crate::say("sums", name, clock.instructions(ticks) as f64);
    }
    Ok(())
}
