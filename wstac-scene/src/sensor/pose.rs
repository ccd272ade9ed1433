//! The pose of a camera that does not look straight on at the whiskers: the `[sensor.pose]` table.
//!
//! ```toml
//! rotation_degrees = 0   # rotation of the picture, counterclockwise; -180 to 180
//! tilt_degrees = [0, 0]  # tilt: right side further away, then lower side further away; -45 to 45
//! curvature = 0          # distortion by the lens: below 0 barrel, above 0 pincushion; -0.15 to 0.15
//! shift = [0, 0]         # shift right and down, in fractions of the picture's shorter side; -2 to 2
//! scale = 1              # scale of the picture, 0.1 to 10
//! uneven = 1             # brightness of the brightest side divided by that of the darkest, 1 to 100
//! uneven_degrees = 0     # direction of the brightest side: 0 is right, 90 is up
//! ```
//!
//! Lengths are in halves of the picture's shorter side, from its middle, x to the right and y down. A pinhole camera
//! sees a plane from [`DISTANCE`]. Then its lens moves a point at distance r from the middle to r · (1 + curvature ·
//! r²).

use libm::{cos, sin, sqrt};
use serde::Deserialize;
use wstac_core::layout::FrameSize;
use wstac_core::params::{COLUMNS, PAPER_IMAGE_SIDE, PAPER_PITCH, ROWS, TAXELS};
use wstac_host::text_file::whole;

use crate::keys::{key_table, within};
use crate::rng::Rng;

/// Distance of the camera (a guess: two picture sides).
const DISTANCE: f64 = 4.0;
/// Distance of neighboring whiskers in the paper's picture.
const PITCH: f64 = PAPER_PITCH as f64 / (PAPER_IMAGE_SIDE as f64 / 2.0);
/// Middle of the grid of whiskers.
const MIDDLE: [f64; 2] = [(COLUMNS / 2) as f64, (ROWS / 2) as f64];

key_table! {
    /// A checked `[sensor.pose]` table.
    #[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Pose {
        /// Rotation of the picture in degrees, counterclockwise, −180..=180.
        pub rotation_degrees: f64 = 0.0, in -180.0..=180.0;
        /// Tilt of the camera in degrees, −45..=45: first its right side further away, then its lower side further
        /// away.
        #[serde(deserialize_with = "whole")]
        pub tilt_degrees: [f64; 2] = [0.0; 2];
        /// Curvature of the lens, −0.15..=0.15: below 0 is barrel, above is pincushion.
        pub curvature: f64 = 0.0, in -0.15..=0.15;
        /// Shift right and down, in fractions of the picture's shorter side, −2..=2.
        #[serde(deserialize_with = "whole")]
        pub shift: [f64; 2] = [0.0; 2];
        /// Scale of the picture, 0.1..=10.
        pub scale: f64 = 1.0, in 0.1..=10.0;
        /// Brightness of the brightest side divided by that of the darkest side, 1..=100.
        pub uneven: f64 = 1.0, in 1.0..=100.0;
        /// Direction of the brightest side in degrees, counterclockwise: 0 is right.
        pub uneven_degrees: f64 = 0.0, in -360.0..=360.0;
    }
}

impl Pose {
    /// Draws a pose from which all whiskers are seen.
    ///
    /// It is rotated by up to 15° and tilted by up to 12° on both axes. The lens moves the middle of a side by up to
    /// 0.08. One side is up to three times as bright.
    pub fn random(rng: &mut Rng, size: FrameSize) -> Self {
        let mut around = |most: f64| most * (2.0 * rng.uniform() - 1.0);
        let [width, height] = [size.width(), size.height()].map(f64::from);
        let room = 0.07 * width.min(height);
        loop {
            let pose = Self {
                rotation_degrees: around(15.0),
                tilt_degrees: [around(12.0), around(12.0)],
                curvature: around(0.08),
                shift: [around(0.04), around(0.04)],
                scale: 0.85 + around(0.1),
                uneven: 2.0 + around(1.0),
                uneven_degrees: around(180.0),
            };
            let inside = |[x, y]: &[f64; 2]| x.min(width - 1.0 - x) > room && y.min(height - 1.0 - y) > room;
            if pose.centers(size).iter().all(inside) {
                return pose;
            }
        }
    }

    /// Checks every key against the range in its description.
    ///
    /// # Errors
    /// A value is out of range; the message names the key, the value found and the values expected.
    pub fn check(&self) -> Result<(), String> {
        self.check_ranges().map_err(|message| format!("pose {message}"))?;
        self.tilt_degrees.iter().try_for_each(|&tilt| within("pose tilt_degrees", tilt, -45.0, 45.0))?;
        self.shift.iter().try_for_each(|&shift| within("pose shift", shift, -2.0, 2.0))
    }

    /// Returns the positions of the whiskers' bases in a frame, row by row.
    ///
    /// They are x and y in pixels; whole numbers are the middle of a pixel.
    pub fn centers(&self, frame: FrameSize) -> [[f64; 2]; TAXELS] {
        let view = View::new(self, frame);
        core::array::from_fn(|taxel| view.seen(base(taxel)))
    }
}

/// Returns the position of a whisker's base on the sensor.
fn base(taxel: usize) -> [f64; 2] {
    let [column, row] = [taxel % COLUMNS, taxel / COLUMNS].map(|k| k as f64);
    [(column - MIDDLE[0]) * PITCH, (row - MIDDLE[1]) * PITCH]
}

/// The mapping from the sensor to pixels of a frame, and back.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// The mapping from the sensor to the picture without the lens, homogeneous.
    forth: [[f64; 3]; 3],
    /// The inverse mapping, up to a positive factor.
    back: [[f64; 3]; 3],
    curvature: f64,
    /// Middle of the picture and half of its shorter side, in pixels.
    middle: [f64; 2],
    half: f64,
    /// Drop of the light from the brightest side, where it is 1, to the darkest side.
    uneven: f64,
    /// Direction of the brightest side.
    towards: [f64; 2],
}

impl View {
    pub(super) fn new(pose: &Pose, frame: FrameSize) -> Self {
        let radians = |degrees: f64| degrees * core::f64::consts::PI / 180.0;
        let turned = |degrees: f64| [cos(radians(degrees)), sin(radians(degrees))];
        let (turn, [across, down]) = (turned(pose.rotation_degrees), pose.tilt_degrees.map(turned));
        // The plane's own x and y, rotated, then tilted: right, down and away from the camera.
        let point = |[x, y]: [f64; 2]| {
            let (right, below) = (x * turn[0] + y * turn[1], y * turn[0] - x * turn[1]);
            let away = right * across[1];
            [right * across[0], below * down[0] - away * down[1], below * down[1] + away * down[0]]
        };
        let (x, y) = (point([1.0, 0.0]), point([0.0, 1.0]));
        let away = [x[2] / DISTANCE, y[2] / DISTANCE, 1.0];
        let row = |k: usize| {
            let [of_x, of_y, of_one] = away.map(|away| 2.0 * pose.shift[k] * away);
            [pose.scale * x[k] + of_x, pose.scale * y[k] + of_y, of_one]
        };
        let forth = [row(0), row(1), away];
        let (width, height) = (f64::from(frame.width()), f64::from(frame.height()));
        let [right, up] = turned(pose.uneven_degrees);
        Self {
            forth,
            back: adjugate(&forth),
            curvature: pose.curvature,
            middle: [(width - 1.0) / 2.0, (height - 1.0) / 2.0],
            half: width.min(height) / 2.0,
            uneven: 1.0 - 1.0 / pose.uneven,
            towards: [right, -up],
        }
    }

    /// Returns the pixel that sees a point of the sensor.
    pub(super) fn seen(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [right, down, away] = self.forth.map(|[of_x, of_y, of_one]| of_x * x + of_y * y + of_one);
        let [right, down] = [right / away, down / away];
        let lens = 1.0 + self.curvature * (right * right + down * down);
        [self.middle[0] + right * lens * self.half, self.middle[1] + down * lens * self.half]
    }

    /// Returns the point of the sensor that a pixel sees, or `None` if the lens or the tilt leaves none.
    pub(super) fn source(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        let [right, down] = self.off_middle(pixel);
        let lens = self.straightened(sqrt(right * right + down * down))?;
        let [x, y, away] =
            self.back.map(|[of_right, of_down, of_one]| of_right * right * lens + of_down * down * lens + of_one);
        (away > 0.0).then(|| [x / away, y / away])
    }

    /// Returns the light of a pixel as a fraction of that at the brightest side.
    pub(super) fn brightness(&self, pixel: [f64; 2]) -> f64 {
        let [right, down] = self.off_middle(pixel);
        let towards = (right * self.towards[0] + down * self.towards[1]).clamp(-1.0, 1.0);
        1.0 - self.uneven * (1.0 - towards) / 2.0
    }

    fn off_middle(&self, pixel: [f64; 2]) -> [f64; 2] {
        [(pixel[0] - self.middle[0]) / self.half, (pixel[1] - self.middle[1]) / self.half]
    }

    /// Returns the factor for a distance from the middle that undoes the lens.
    fn straightened(&self, distance: f64) -> Option<f64> {
        let mut straight = distance;
        for _ in 0..20 {
            let square = straight * straight;
            let slope = 1.0 + 3.0 * self.curvature * square;
            // Beyond this point a barrel lens would fold the picture.
            if slope < 0.05 {
                return None;
            }
            straight -= (straight * (1.0 + self.curvature * square) - distance) / slope;
        }
        let lens = 1.0 + self.curvature * straight * straight;
        (libm::fabs(straight * lens - distance) < 1e-6).then(|| 1.0 / lens)
    }
}

/// Returns the nearest taxel of a point on the sensor, and the distance from its base.
///
/// The distance is in half sides of a tactile picture.
pub(super) fn nearest([x, y]: [f64; 2]) -> (usize, f64) {
    let nearest = |at: f64, middle: f64, count: usize| {
        let place = at / PITCH + middle;
        libm::round(place).clamp(0.0, (count - 1) as f64) as usize
    };
    let taxel = nearest(y, MIDDLE[1], ROWS) * COLUMNS + nearest(x, MIDDLE[0], COLUMNS);
    let [left, top] = base(taxel);
    (taxel, sqrt((x - left) * (x - left) + (y - top) * (y - top)))
}

/// Returns the inverse of a matrix times its determinant, which is above 0 for all that a camera sees.
fn adjugate([a, b, c]: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let cross =
        |u: &[f64; 3], v: &[f64; 3]| [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let (x, y, z) = (cross(b, c), cross(c, a), cross(a, b));
    [0, 1, 2].map(|k| [x[k], y[k], z[k]])
}

#[cfg(test)]
mod tests {
    use wstac_core::layout::Layout;

    use super::*;

    fn frame(width: u32, height: u32) -> FrameSize {
        FrameSize::new(width, height).unwrap()
    }

    #[test]
    fn the_documented_values_are_the_defaults() {
        let lines = include_str!("pose.rs").lines().skip_while(|line| *line != "//! ```toml").skip(1);
        let table: String = lines
            .map_while(|line| line.strip_prefix("//! "))
            .take_while(|line| *line != "```")
            .fold(String::new(), |table, line| table + line + "\n");
        assert_eq!(table.lines().count(), 7);
        assert_eq!(toml::from_str::<Pose>(&table).unwrap(), Pose::default());
        assert!(toml::from_str::<Pose>("roll = 3").is_err());
        let wrong = Pose { tilt_degrees: [0.0, f64::NAN], ..Pose::default() };
        assert!(wrong.check().unwrap_err().contains("pose tilt_degrees is NaN, expected -45 to 45"));
    }

    #[test]
    fn straight_on_it_is_the_papers_layout() {
        for (width, height) in [(400, 400), (1280, 720), (640, 480), (301, 240)] {
            let layout = Layout::paper(frame(width, height)).unwrap();
            let side = f64::from(layout.taxel()[0]);
            for (center, corner) in Pose::default().centers(layout.frame()).iter().zip(layout.corners()) {
                for (center, corner) in center.iter().zip(corner) {
                    // The layout's numbers are rounded.
                    let off = center - (f64::from(*corner) + (side - 1.0) / 2.0);
                    assert!(off.abs() <= 0.751, "{width}x{height}: {off}");
                }
            }
        }
    }

    #[test]
    fn turns_shifts_and_lenses_go_the_way_they_say() {
        let corner = |pose: Pose| pose.centers(frame(400, 400))[0];
        let [left, top] = corner(Pose::default());
        let near = |found: [f64; 2], expected: [f64; 2]| {
            let off = found.iter().zip(expected).map(|(found, expected)| (found - expected).abs());
            assert!(off.fold(0.0, f64::max) < 1e-9, "{found:?}, expected {expected:?}");
        };
        near([left, top], [39.5, 39.5]);
        near(corner(Pose { rotation_degrees: 90.0, ..Pose::default() }), [39.5, 359.5]);
        near(corner(Pose { shift: [0.1, -0.05], scale: 0.5, ..Pose::default() }), [159.5, 99.5]);
        // 0.8 from the middle on either axis: r² is 1.28.
        near(corner(Pose { curvature: -0.1, ..Pose::default() }), [199.5 - 160.0 * 0.872, 199.5 - 160.0 * 0.872]);
        let tilted = Pose { tilt_degrees: [20.0, 0.0], ..Pose::default() }.centers(frame(400, 400));
        assert!(tilted[20][1] - tilted[0][1] > 320.0 && tilted[24][1] - tilted[4][1] < 320.0, "left is nearer");
    }

    #[test]
    fn every_pixel_finds_its_way_back() {
        let pose = Pose {
            rotation_degrees: -13.0,
            tilt_degrees: [9.0, -14.0],
            curvature: -0.08,
            shift: [0.04, -0.03],
            scale: 0.9,
            ..Pose::default()
        };
        for curvature in [-0.08, 0.0, 0.12] {
            let view = View::new(&Pose { curvature, ..pose }, frame(640, 480));
            for y in (60..420).step_by(37) {
                for x in (150..490).step_by(41) {
                    let pixel = [f64::from(x), f64::from(y)];
                    let again = view.seen(view.source(pixel).unwrap());
                    assert!((again[0] - pixel[0]).abs() + (again[1] - pixel[1]).abs() < 1e-4, "{pixel:?} {again:?}");
                }
            }
        }
    }

    #[test]
    fn the_bright_side_is_where_it_is_said_to_be() {
        let view = View::new(&Pose { uneven: 3.0, uneven_degrees: 90.0, ..Pose::default() }, frame(400, 400));
        let [top, bottom] = [0.0, 399.0].map(|y| view.brightness([50.0, y]));
        assert!(top > 0.99 && (bottom - 1.0 / 3.0).abs() < 0.01, "{top} {bottom}");
    }
}
