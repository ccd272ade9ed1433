//! A specimen's top as whiskers meet it: smooth segments, with kinks and jumps only between them.

use libm::{fabs, sin, sqrt, tan};

use super::specimen::{Pattern, Specimen};

/// Position at which the side lobe of |sinc| is highest, as a fraction of a period from its crest.
///
/// It solves tan x = x, x = 4 π · fraction.
const SIDE_LOBE: f64 = 4.493_409_457_909_064 / (4.0 * core::f64::consts::PI);

/// Shortest time in s that a path in time is divided into.
const LEAST_S: f64 = 1e-9;
/// Largest distance in mm of a path in time from its lines.
const LEAST_DROP_MM: f64 = 2e-4;

/// A stretch of the top.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// Its start, in mm behind the leading end.
    pub from: f64,
    /// Its end, in mm behind the leading end.
    pub to: f64,
    shape: Shape,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    /// A straight line: `drop + slope · (at − from)`.
    Line { from: f64, drop: f64, slope: f64 },
    /// |sinc| around its crest, in mm; four of its half widths are a period.
    Sinc { crest: f64, period: f64, depth: f64 },
    /// The top of a circle.
    Arc { crest: f64, radius: f64 },
}

impl Segment {
    pub(crate) fn is_straight(&self) -> bool {
        matches!(self.shape, Shape::Line { .. })
    }

    /// Returns how far the top is below the crests, in mm, at a place within the segment, its ends included.
    #[inline]
    pub(crate) fn drop_mm(&self, at: f64) -> f64 {
        match self.shape {
            Shape::Line { from, drop, slope } => drop + slope * (at - from),
            Shape::Sinc { crest, period, depth } => {
                let x = 4.0 * core::f64::consts::PI * (at - crest) / period;
                let sinc = if fabs(x) < 1e-9 { 1.0 } else { sin(x) / x };
                depth * (1.0 - fabs(sinc))
            }
            Shape::Arc { crest, radius } => {
                let away = at - crest;
                radius - sqrt((radius * radius - away * away).max(0.0))
            }
        }
    }
}

/// A specimen's top from its leading to its trailing end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    segments: Vec<Segment>,
}

impl Surface {
    /// Creates the top of `specimen`.
    ///
    /// Its ends slope down until `overlap_mm` below its crests: there no whisker is touched. A block with two-sided
    /// texture begins on a crest; a sawtooth begins in its valley.
    pub(crate) fn new(specimen: &Specimen, overlap_mm: f64) -> Self {
        if let Some(radius) = specimen.arc_mm() {
            let half = |from: f64| Segment { from, to: from + radius, shape: Shape::Arc { crest: radius, radius } };
            return Self { segments: vec![half(0.0), half(radius)] };
        }
        let length = specimen.length_mm;
        let ends = ends(length, overlap_mm, specimen.edge_degrees);
        let mut segments = Vec::new();
        for texture in texture(specimen) {
            for end in &ends {
                let (from, to) = (texture.from.max(end.from), texture.to.min(end.to));
                if from < to {
                    lower_of(&texture, end, from, to, &mut segments);
                }
            }
        }
        Self { segments }
    }

    /// Creates the path of a plate in time: down by `overlap_mm`, level, and up again in the `times_s` of a press. All
    /// places are in s after the start.
    ///
    /// A whisker that the plate reaches later, because of the dome, meets a later part of the path.
    pub(crate) fn plate(overlap_mm: f64, times_s: [f64; 3]) -> Self {
        let ([down, lift, _], up) = (times_s, times_s[0] + times_s[2]);
        let [falls, rises] = [down, lift].map(|time_s| overlap_mm / time_s);
        let lines = [(0.0, down, overlap_mm, -falls), (down, up, 0.0, 0.0), (up, up + lift, 0.0, rises)];
        Self { segments: lines_of(lines) }
    }

    /// Creates a path in time from how far the top is below the crests at a moment; infinite if there is none.
    ///
    /// It consists of straight lines. Between two of the `moments` nothing changes that halves of the time between them
    /// do not show; jumps are found to a rounding error.
    pub(crate) fn in_time(moments: &[f64], drop: impl Fn(f64) -> f64) -> Self {
        let mut path = Self::default();
        let mut last: Option<[f64; 2]> = None;
        for &moment in moments {
            let next = [moment, drop(moment)];
            if let Some(last) = last {
                path.add(&drop, last, next);
            }
            last = Some(next);
        }
        path
    }

    /// Adds the path between two moments with their drops.
    fn add(&mut self, drop: &impl Fn(f64) -> f64, [from, first]: [f64; 2], [to, last]: [f64; 2]) {
        let length = to - from;
        let at = |share: f64| drop(from + share * length);
        // A second place finds what is the same on both sides of the middle.
        let off = |share: f64| fabs(at(share) - first - (last - first) * share);
        let middle = at(0.5);
        if length <= LEAST_S || off(0.5) <= LEAST_DROP_MM && off(0.21) <= LEAST_DROP_MM {
            // At a jump, one side counts.
            let (first, last) = if first.is_finite() { (first, last) } else { (last, last) };
            let slope = if last.is_finite() && length > 0.0 { (last - first) / length } else { 0.0 };
            if first.is_finite() && length > 0.0 {
                self.push_line(from, to, first, slope);
            }
        } else if [first, middle, last, at(0.21)].iter().any(|drop| drop.is_finite()) {
            let half = [from + 0.5 * length, middle];
            self.add(drop, [from, first], half);
            self.add(drop, half, [to, last]);
        }
    }

    /// Adds a line, or extends the last one if it leads there.
    fn push_line(&mut self, from: f64, to: f64, drop: f64, slope: f64) {
        if let Some(last) = self.segments.last_mut() {
            let goes_on = |at: f64, drop: f64| fabs(last.drop_mm(at) - drop) < LEAST_DROP_MM / 1e3;
            if last.to >= from && goes_on(from, drop) && goes_on(to, drop + slope * (to - from)) {
                last.to = to;
                return;
            }
        }
        self.segments.push(Segment { from, to, shape: Shape::Line { from, drop, slope } });
    }

    /// Returns its segments in order; beyond them the block is not near a whisker.
    pub(crate) fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Returns the segments that reach beyond `from`.
    pub(crate) fn segments_from(&self, from: f64) -> &[Segment] {
        let first = self.segments.partition_point(|segment| segment.to <= from);
        self.segments.get(first..).unwrap_or_default()
    }

    pub(crate) fn length_mm(&self) -> f64 {
        self.segments.last().map_or(0.0, |segment| segment.to)
    }
}

/// Returns the slopes of both ends and the level crests between them.
fn ends(length: f64, depth: f64, degrees: f64) -> Vec<Segment> {
    let slope = if degrees >= 90.0 { f64::INFINITY } else { tan(degrees * core::f64::consts::PI / 180.0) };
    // If the ends meet before they reach the crests, they leave a ridge.
    let run = (depth / slope).min(length / 2.0);
    let level = (run, length - run, 0.0, 0.0);
    lines_of([(0.0, run, depth, -slope), level, (length - run, length, depth - slope * run, slope)])
}

/// Returns straight segments of these starts and ends, drops at the start, and slopes; those of no length are left out.
fn lines_of(lines: [(f64, f64, f64, f64); 3]) -> Vec<Segment> {
    let line = |(from, to, drop, slope)| Segment { from, to, shape: Shape::Line { from, drop, slope } };
    lines.into_iter().filter(|(from, to, ..)| from < to).map(line).collect()
}

/// Returns the texture over the whole block, without its ends.
fn texture(specimen: &Specimen) -> Vec<Segment> {
    let Specimen { length_mm: length, depth_mm: depth, period_mm: period, .. } = *specimen;
    let flat = |from, to| Segment { from, to, shape: Shape::Line { from, drop: 0.0, slope: 0.0 } };
    if !specimen.is_textured() || depth <= 0.0 || period <= 0.0 {
        return vec![flat(0.0, length)];
    }
    // Segments of a period: start and end as fractions of it.
    let shares: &[f64] = match specimen.pattern {
        Pattern::Sinc => &[0.0, 0.25, SIDE_LOBE, 0.5, 1.0 - SIDE_LOBE, 0.75, 1.0],
        Pattern::Tri => &[0.0, 0.5, 1.0],
        _ => &[0.0, 1.0],
    };
    let periods = libm::ceil(length / period) as usize;
    let starts = (0..periods).map(|k| k as f64 * period);
    let all = starts.flat_map(|start| {
        shares.windows(2).map(move |pair| {
            let [a, b] = [pair[0], pair[1]];
            let from = start + a * period;
            let shape = match specimen.pattern {
                Pattern::Sinc => Shape::Sinc { crest: if a < 0.5 { start } else { start + period }, period, depth },
                Pattern::Tri if a < 0.5 => Shape::Line { from, drop: 0.0, slope: 2.0 * depth / period },
                Pattern::Tri => Shape::Line { from, drop: depth, slope: -2.0 * depth / period },
                _ => Shape::Line { from, drop: depth, slope: -depth / period },
            };
            Segment { from, to: start + b * period, shape }
        })
    });
    let mut all: Vec<Segment> = all.filter(|segment| segment.from < length).collect();
    if let Some(last) = all.last_mut() {
        last.to = last.to.min(length);
    }
    all
}

/// Adds the lower of two segments between `from` and `to`, if both are present, cut at their crossings.
fn lower_of(a: &Segment, b: &Segment, from: f64, to: f64, segments: &mut Vec<Segment>) {
    /// Number of parts of a stretch; crossings that are nearer to each other than a part are not found.
    const PARTS: usize = 32;
    let b_is_lower = |at: f64| b.drop_mm(at) > a.drop_mm(at);
    let at = |part: usize| from + (to - from) * part as f64 / PARTS as f64;
    // Compare in the middle of a part: at the ends both may be equal.
    let middle = |part: usize| 0.5 * (at(part) + at(part + 1));
    let mut start = from;
    let mut lower = b_is_lower(middle(0));
    let mut push = |from: f64, to: f64, b_is_lower: bool| {
        let shape = if b_is_lower { b.shape } else { a.shape };
        segments.push(Segment { from, to, shape });
    };
    for part in 1..PARTS {
        if b_is_lower(middle(part)) == lower {
            continue;
        }
        let (mut low, mut high) = (middle(part - 1), middle(part));
        for _ in 0..60 {
            let between = 0.5 * (low + high);
            if b_is_lower(between) == lower { low = between } else { high = between }
        }
        push(start, low, lower);
        (start, lower) = (low, !lower);
    }
    push(start, to, lower);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn top(specimen: &Specimen, at: f64) -> f64 {
        let surface = Surface::new(specimen, 3.0);
        surface.segments_from(at).first().map_or(f64::INFINITY, |segment| segment.drop_mm(at))
    }

    #[test]
    fn segments_follow_each_other_from_end_to_end() {
        let mut odd = Specimen::ALL.to_vec();
        odd.push(Specimen { length_mm: 1.0, ..Specimen::ALL[5] });
        odd.push(Specimen { length_mm: 33.3, edge_degrees: 90.0, ..Specimen::ALL[8] });
        odd.push(Specimen { period_mm: 0.7, edge_degrees: 10.0, ..Specimen::ALL[2] });
        odd.push(Specimen::sphere(0.5));
        for specimen in &odd {
            let surface = Surface::new(specimen, 3.0);
            let segments = surface.segments();
            assert!(segments[0].from.abs() < 1e-12, "{specimen}");
            assert!((surface.length_mm() - specimen.length_mm).abs() < 1e-12, "{specimen}");
            for pair in segments.windows(2) {
                assert!((pair[0].to - pair[1].from).abs() < 1e-12 && pair[0].from < pair[0].to, "{specimen}");
            }
            for segment in segments {
                for part in 0..=10 {
                    let at = segment.from + (segment.to - segment.from) * f64::from(part) / 10.0;
                    let drop = segment.drop_mm(at);
                    assert!((-1e-9..=3.0_f64.max(specimen.depth_mm) + 1e-9).contains(&drop), "{specimen} {at} {drop}");
                }
            }
        }
    }

    #[test]
    fn textures_go_from_crest_to_valley_within_a_period() {
        for specimen in &Specimen::ALL[1..] {
            let drops = || (0..=2000).map(|k| top(specimen, 48.0 + f64::from(k) * 1e-3 * specimen.depth_mm));
            let highest = drops().fold(f64::INFINITY, f64::min);
            let lowest = drops().fold(0.0, f64::max);
            assert!(highest < 0.01, "{specimen} {highest}");
            assert!((lowest - specimen.depth_mm).abs() < 0.01, "{specimen} {lowest}");
        }
    }

    #[test]
    fn shapes_are_what_their_names_say() {
        let [tri, saw, sin] = [8, 5, 2].map(|k| Specimen::ALL[k]);
        // 48 mm is the start of a period of 6 mm.
        for (specimen, at, drop) in [
            (tri, 48.0, 0.0),
            (tri, 49.5, 1.5),
            (tri, 51.0, 3.0),
            (saw, 48.0001, 3.0),
            (saw, 51.0, 1.5),
            (saw, 53.9999, 0.0),
            (sin, 48.0, 0.0),
            (sin, 48.75, 3.0 * (1.0 - 2.0 / core::f64::consts::PI)),
            (sin, 49.5, 3.0),
            // The side lobe: 0.2172 of the main one.
            (sin, 48.0 + 6.0 * SIDE_LOBE, 3.0 * (1.0 - 0.217_234)),
        ] {
            assert!((top(&specimen, at) - drop).abs() < 1e-3, "{specimen} {at}: {}", top(&specimen, at));
        }
        let sphere = Specimen::sphere(0.5);
        assert!((top(&sphere, 0.5)).abs() < 1e-12 && (top(&sphere, 0.2) - 0.1).abs() < 1e-12);
        assert!(top(&sphere, 1.1).is_infinite());
    }

    #[test]
    fn ends_slope_as_they_are_told_to() {
        let flat = Specimen { edge_degrees: 45.0, ..Specimen::ALL[0] };
        assert!((top(&flat, 1.0) - 2.0).abs() < 1e-9 && top(&flat, 3.1).abs() < 1e-12);
        assert!((top(&flat, flat.length_mm - 0.5) - 2.5).abs() < 1e-9);
        let upright = Specimen { edge_degrees: 90.0, ..flat };
        assert!(top(&upright, 1e-9).abs() < 1e-12);
        // A texture shows at places that are lower than the slope.
        let tri = Specimen { edge_degrees: 45.0, ..Specimen::ALL[9] };
        assert!((top(&tri, 2.5) - 2.5).abs() < 1e-9 && (top(&tri, 0.5) - 2.5).abs() < 1e-9);
    }
}
