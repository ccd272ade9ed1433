//! Every constant of the sensor and of its arithmetic, with its value, unit and source.
//!
//! *Paper* marks a published number. *Decided* marks a number that the published description leaves open.

/// Rows of taxels, top to bottom (paper).
pub const ROWS: usize = 5;
/// Columns of taxels, left to right (paper).
pub const COLUMNS: usize = 5;
/// Taxels, one at each whisker's base, stored row by row (paper).
pub const TAXELS: usize = ROWS * COLUMNS;
/// Features of a frame: five rows, then five columns (paper, equation 1).
pub const FEATURES: usize = ROWS + COLUMNS;

/// Frames of a sample, l (paper).
pub const SAMPLE_FRAMES: usize = 70;
/// Fraction bits of a feature: its unit is 2^-11 of a natural logarithm (decided).
pub const FEATURE_FRACTION_BITS: u32 = 11;
/// The number one, in units of a feature.
pub const FEATURE_ONE: i32 = 1 << FEATURE_FRACTION_BITS;
/// The longest run of lost frames that is filled: l / 10 (decided). A longer run ends what was under way.
pub const LONGEST_FILLED_GAP: u32 = SAMPLE_FRAMES as u32 / 10;

/// Side of the tactile image that the paper layout is stated in, in pixels (paper).
pub const PAPER_IMAGE_SIDE: u32 = 400;
/// Side of a taxel in that image, in pixels (paper).
pub const PAPER_TAXEL_SIDE: u32 = 50;
/// Distance between the corners of neighboring taxels in that image, in pixels (decided).
pub const PAPER_PITCH: u32 = 80;
/// Distance of the first corner from the image's edges, in pixels (decided).
pub const PAPER_FIRST_CORNER: u32 = 15;

/// Distance between neighboring whiskers in mm (decided).
pub const PITCH_MM: f32 = 4.0;

/// Frame rate that the sample length and the speed law are stated for, in frames per second (paper).
pub const NOMINAL_FRAME_RATE: u32 = 30;
/// Above this rate, in frames per second, consecutive frames are added up (decided).
pub const HIGHEST_SINGLE_FRAME_RATE: u32 = 45;
/// Largest width and height of a frame, in pixels.
pub const LARGEST_FRAME_SIDE: u32 = 16_384;

/// Darkness floor, in gray levels of a taxel: below it a feature carries no information (decided).
pub const DEFAULT_FLOOR_LEVELS: f64 = 0.5;

/// Windows of the baseline (paper).
pub const BASELINE_WINDOWS: u32 = 5;
/// Frames of a window, m (decided).
pub const DEFAULT_WINDOW: u8 = 5;
/// Threshold multiplier, b (decided).
pub const DEFAULT_MULTIPLIER: f64 = 1.2;
/// Frames of a sample before the window that fired, c (decided).
pub const DEFAULT_BACKTRACK: u16 = 10;
/// Least distance of the signed rule's threshold from the baseline, in units of a feature's natural logarithm per frame
/// (decided).
pub const DEFAULT_MARGIN: f64 = 0.2;

/// Dark frames behind a touch after which it has ended, if there is one event per touch (decided).
pub const DARK_FRAMES: u8 = 5;
/// Dark frames behind an event without a reliable answer after which light is another touch: at 5 mm/s whiskers flash
/// for 5 frames, 24 apart (decided).
pub const SLOW_DARK_FRAMES: u8 = 20;

/// Shortest time constant of a tracking baseline, in windows (decided).
pub const SHORTEST_FOLLOW: u32 = 16;
/// Longest time constant of a tracking baseline, in windows (decided).
pub const LONGEST_FOLLOW: u32 = 32_768;

/// A frame is valid if a row or column of taxels is brighter than this fraction of full scale (paper).
pub const VALID_THRESHOLD: f64 = 0.0475;
/// Intercept of the published speed law, in frames at 30 frames per second (paper, R² 0.99).
pub const SPEED_INTERCEPT: f32 = 151.06;
/// Slope of the published speed law, in frames per decade of mm/s, sign dropped (paper, R² 0.99).
pub const SPEED_SLOPE: f32 = 56.29;
/// Slowest slide that the speed law was fitted on, in mm/s (paper).
pub const SLOWEST_FITTED: f32 = 100.0;
/// Fastest slide that the speed law was fitted on, in mm/s (paper).
pub const FASTEST_FITTED: f32 = 200.0;

/// Least confidence of a direction, as numerator and denominator: 0.2 (decided).
pub const LEAST_CONFIDENCE: (u64, u64) = (1, 5);
