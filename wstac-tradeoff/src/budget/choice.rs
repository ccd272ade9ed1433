//! Selection of the best configuration within a budget, and of a cheaper one that is nearly as good.

use std::cmp::Ordering;
use std::fmt;

use super::{Budget, Limit, What};
use crate::candidate::{NONE, short};
use crate::parameters::Format;
use crate::prices::{Core, Price, Prices};
use crate::row::{Row, motion_latency};
use crate::table::grouped;
use wstac_core::params::NOMINAL_FRAME_RATE;

/// Difference of scores, in percent, up to which they count as nearly equal; sensors differ by more.
const NEARLY: f64 = 1.0;

/// The quantity to optimize.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum By {
    /// Specimen accuracy.
    #[default]
    Specimen,
    /// Pattern accuracy.
    Pattern,
    /// Depth accuracy.
    Depth,
    /// Error of speed; slides without a speed count as 100 %.
    Speed,
    /// Directions that are wrong or missing.
    Direction,
    /// Touches of rods, balls, coins, corners and narrow blocks that are reliable and right.
    Objects,
    /// Root mean square error of lit features.
    Features,
}

impl By {
    /// Returns the score of a row, higher is better, in percent except for features; `None` if it is not known.
    fn score(self, row: &Row) -> Option<f64> {
        let found = &row.found;
        let accuracy = |task: usize| found.accuracy[task].map(|interval| interval.mean);
        match self {
            Self::Specimen => accuracy(0),
            Self::Pattern => accuracy(1),
            Self::Depth => accuracy(2),
            Self::Speed => {
                let missing = found.speedless as f64 / found.speed_slides.max(1) as f64;
                found.speed.map(|[mean, _]| -(mean * (1.0 - missing) + 100.0 * missing))
            }
            Self::Direction => Some(-100.0 * found.direction_errors as f64 / found.slides.max(1) as f64),
            Self::Objects => found.objects,
            Self::Features => Some(-found.feature[1]),
        }
    }

    /// Returns `true` if the quantity comes with speed and direction, even if a model answers before.
    fn is_of_motion(self) -> bool {
        matches!(self, Self::Speed | Self::Direction | Self::Objects)
    }
}

/// The result of a selection.
#[derive(Clone, Copy, Debug)]
pub struct Choice<'r> {
    /// The best configuration.
    pub best: &'r Row,
    /// The cheapest that is within 1 percentage point of the best, if it is another one.
    pub nearly: Option<&'r Row>,
}

/// A map, and the budget for the selection.
struct Question<'q> {
    rows: &'q [Row],
    budget: &'q Budget,
    by: By,
    prices: &'q Prices,
    default: Core,
}

/// The amount of a limit that a row takes.
struct Taken<'q> {
    limit: &'q Limit,
    core: Option<Core>,
    /// The amount, or `None` if it is not known.
    takes: Option<f64>,
}

/// Returns the best row that fits.
///
/// Of several equally good rows, it is the one with the fewest instructions per second on the first core. MJPEG is
/// evaluated on fewer slides, and so more by chance. It is selected only if no other format fits.
///
/// # Errors
/// No row fits; the message names the nearest miss, or the reason why there is none.
pub fn best<'r>(
    rows: &'r [Row],
    budget: &Budget,
    by: By,
    prices: &Prices,
    default: Core,
) -> Result<Choice<'r>, String> {
    let question = Question { rows, budget, by, prices, default };
    let wanted: Vec<&'r Row> = rows.iter().filter(|row| budget.is_of(row) && by.score(row).is_some()).collect();
    let fit = wanted.iter().copied().filter(|row| question.taken(row).iter().all(Taken::fits));
    let (mjpeg, others): (Vec<&'r Row>, Vec<_>) = fit.partition(|row| row.setting.format == Format::Mjpeg);
    let fit = if others.is_empty() { mjpeg } else { others };
    let score = |row: &Row| by.score(row).unwrap_or(f64::NEG_INFINITY);
    let cheaper = |a: &Row, b: &Row| question.cost(a).cmp(&question.cost(b));
    // Of equal rows the first wins, which is simpler.
    let best = fit.iter().copied().min_by(|a, b| score(b).total_cmp(&score(a)).then_with(|| cheaper(a, b)));
    let best = best.ok_or_else(|| question.why_nothing(&wanted))?;
    let near = fit.into_iter().filter(|row| by != By::Features && score(row) >= score(best) - NEARLY);
    let nearly = near.min_by(|a, b| cheaper(a, b)).filter(|row| cheaper(row, best) == Ordering::Less);
    Ok(Choice { best, nearly })
}

impl<'q> Question<'q> {
    /// Returns the instructions per second on the first core; rows without unknown prices sort first.
    fn cost(&self, row: &Row) -> (bool, i64) {
        let core = self.budget.cores(self.default).first().copied().unwrap_or(self.default);
        let price = self.prices.of(core, &row.setting, row.model.as_deref());
        match price.map(|price| (price.instructions_per_second(), price.frame())) {
            Some((Some(whole), _)) => (false, whole),
            Some((None, frame)) => (true, frame),
            None => (true, i64::MAX),
        }
    }

    /// Returns the amount of each limit that a row takes, on each core.
    fn taken(&self, row: &Row) -> Vec<Taken<'q>> {
        let cores = self.budget.cores(self.default);
        let mut all = Vec::new();
        for limit in &self.budget.limits {
            let of_core = |core: Core, take: fn(&Price) -> Option<i64>| {
                let price = self.prices.of(core, &row.setting, row.model.as_deref());
                let takes = price.as_ref().and_then(take).map(|takes| takes as f64);
                Taken { limit, core: Some(core), takes }
            };
            let of_row = |takes| Taken { limit, core: None, takes };
            match limit.what {
                What::Frame(core) => all.push(of_core(core, |price| Some(price.frame()))),
                What::Event(core) => all.push(of_core(core, Price::event)),
                What::Flash => all.extend(cores.iter().map(|core| of_core(*core, |price| price.flash))),
                What::Ram => all.extend(cores.iter().map(|core| of_core(*core, |price| price.ram))),
                What::Frames if self.by.is_of_motion() => all.push(of_row(motion_latency(row, self.rows))),
                What::Frames => all.push(of_row(row.found.latency)),
            }
        }
        all
    }

    /// Explains why no row fits.
    ///
    /// Of the wanted rows, it names the one that misses the fewest terms, and among those by the smallest amount.
    fn why_nothing(&self, wanted: &[&Row]) -> String {
        let missed = |row: &Row| {
            let taken = self.taken(row);
            let missed = taken.iter().filter(|taken| !taken.fits());
            missed.fold((0, 0.0), |(count, most), taken| (count + 1, taken.ratio().max(most)))
        };
        let order = |a: (u32, f64), b: (u32, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
        let nearest = wanted.iter().map(|row| (missed(row), *row)).min_by(|a, b| order(a.0, b.0));
        if let Some((_, row)) = nearest {
            let model = short(row.model.as_deref().unwrap_or(NONE));
            let missed = self.taken(row).into_iter().filter(|taken| !taken.fits()).map(|taken| taken.to_string());
            let missed = missed.collect::<Vec<_>>().join("; ");
            let is_needed = wanted.iter().all(|row| row.model.is_some());
            let less = if is_needed { "; help: --by speed, direction or objects need no model" } else { "" };
            return format!("no configuration fits; the nearest is {}, model {model}: {missed}{less}", row.setting);
        }
        if self.rows.iter().any(|row| self.budget.is_of(row)) {
            return "no configuration with these parameters tells what --by is about; without a model: --by speed, direction or \
                features, and, but for MJPEG, objects"
                .to_owned();
        }
        "no configuration of the map has these parameters".to_owned()
    }
}

impl Taken<'_> {
    fn fits(&self) -> bool {
        let Limit { most, or_equal, .. } = self.limit;
        self.takes.is_some_and(|takes| if *or_equal { takes <= *most } else { takes < *most })
    }

    /// Returns the amount as a multiple of the limit, or infinity if it is not known.
    fn ratio(&self) -> f64 {
        self.takes.map_or(f64::INFINITY, |takes| takes / self.limit.most)
    }
}

impl fmt::Display for Taken<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = match self.limit.what {
            What::Frame(_) => "instructions per frame",
            What::Event(_) => "instructions per event",
            What::Flash => "bytes of flash",
            What::Ram => "bytes of RAM",
            What::Frames => "frames to the answer",
        };
        if let Some(core) = self.core {
            write!(f, "{}: ", core.name())?;
        }
        match (self.takes, &self.limit.what) {
            (Some(takes), What::Frames) => {
                write!(f, "{takes:.1} frames, {:.2} s, to the answer", takes / f64::from(NOMINAL_FRAME_RATE))
            }
            (Some(takes), _) => write!(f, "{} {unit}", grouped(takes as i64)),
            (None, _) => write!(f, "{unit} not known"),
        }?;
        write!(f, ", expected {}", self.limit.term)
    }
}
