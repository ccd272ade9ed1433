//! Elliptic integrals in Carlson's symmetric forms.
//!
//! Source: B. C. Carlson, "Numerical computation of real or complex elliptic integrals", 1995. The forms have no
//! cancellation if the modulus is next to 1, as it is under large loads.
//!
//! The project has its own code so that the results have the same bits on every machine. The code uses only the four
//! operations and square roots, which IEEE 754 rounds exactly.

use libm::{fabs, sqrt};

/// Computes R_F(x, y, z) for non-negative arguments, at most one of them 0; the relative error is below 1e-15.
pub(super) fn r_f(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    loop {
        let mean = (x + y + z) / 3.0;
        let (dx, dy, dz) = (1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean);
        // The series' next term is of the sixth order.
        if fabs(dx).max(fabs(dy)).max(fabs(dz)) < 2e-3 {
            let (e2, e3) = (dx * dy - dz * dz, dx * dy * dz);
            return (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / sqrt(mean);
        }
        let lambda = sqrt(x * y) + sqrt(y * z) + sqrt(z * x);
        (x, y, z) = ((x + lambda) / 4.0, (y + lambda) / 4.0, (z + lambda) / 4.0);
    }
}

/// Computes R_D(x, y, z) for non-negative x and y, at most one of them 0, and z > 0; the relative error is below 1e-14.
pub(super) fn r_d(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    let (mut sum, mut factor) = (0.0, 1.0);
    loop {
        let mean = (x + y + 3.0 * z) / 5.0;
        let (dx, dy, dz) = (1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean);
        if fabs(dx).max(fabs(dy)).max(fabs(dz)) < 1.5e-3 {
            let (ea, eb) = (dx * dy, dz * dz);
            let (ec, ed) = (ea - eb, ea - 6.0 * eb);
            let ee = ed + 2.0 * ec;
            let series = 1.0
                + ed * (-3.0 / 14.0 + 9.0 / 88.0 * ed - 9.0 / 52.0 * dz * ee)
                + dz * (ee / 6.0 + dz * (-9.0 / 22.0 * ec + 3.0 / 26.0 * dz * ea));
            return 3.0 * sum + factor * series / (mean * sqrt(mean));
        }
        let lambda = sqrt(x * y) + sqrt(y * z) + sqrt(z * x);
        sum += factor / (sqrt(z) * (z + lambda));
        factor /= 4.0;
        (x, y, z) = ((x + lambda) / 4.0, (y + lambda) / 4.0, (z + lambda) / 4.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_carlsons_published_values() {
        for (found, expected) in [
            (r_f(1.0, 2.0, 0.0), 1.311_028_777_146_059_9),
            (r_f(2.0, 3.0, 4.0), 0.584_082_841_677_151_7),
            (r_d(0.0, 2.0, 1.0), 1.797_210_352_103_388_3),
            (r_d(2.0, 3.0, 4.0), 0.165_105_272_942_610_53),
        ] {
            assert!((found / expected - 1.0).abs() < 1e-14, "{found} for {expected}");
        }
    }
}
