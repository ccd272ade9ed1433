//! The matrix of cross-talk, as the scenes have it.

use wstac_core::touch::crosstalk::Correction;
use wstac_host::config::Config;

use super::scenes::{CROSSTALK, Fault};

/// Returns the correction that a fault's estimator has.
pub(super) fn correction(fault: Fault) -> Option<Correction> {
    (fault == Fault::KnownCrosstalk).then(|| of_matrix(&known()))
}

fn of_matrix(matrix: &[[f64; 25]; 25]) -> Correction {
    let config = Config::parse(&format!("[layout]\ncrosstalk = {matrix:?}")).expect("the matrix is one of cross-talk");
    config.layout.correction().expect("the configuration has one")
}

/// Returns the matrix of the scenes: each of the four beside a whisker sees the same.
fn known() -> [[f64; 25]; 25] {
    let far = |a: usize, b: usize| (a / 5).abs_diff(b / 5) + (a % 5).abs_diff(b % 5);
    core::array::from_fn(|taxel| core::array::from_fn(|whisker| [1.0, CROSSTALK, 0.0][far(taxel, whisker).min(2)]))
}
