//! What may be spent: `M4F<60000,flash<64K` and the like.

use std::fmt;
use std::str::FromStr;

use super::candidate::{NONE, short};
use super::knobs::{Format, KERNELS, STRIDES, kernel_name};
use super::prices::{Core, Price, Prices};
use super::row::Row;
use super::table::grouped;

/// What a term is about.
#[derive(Clone, Debug, PartialEq)]
enum What {
    /// Instructions a frame on a core.
    Frame(Core),
    /// Instructions an event on a core.
    Event(Core),
    /// Bytes of flash, on the cores that other terms name.
    Flash,
    /// Bytes of RAM, likewise.
    Ram,
    /// Frames from the first touch to the answer.
    Frames,
    /// ns a frame on the host that the map was made on.
    Host,
    /// ns an event there.
    HostEvent,
}

/// A limit.
#[derive(Clone, Debug, PartialEq)]
struct Limit {
    term: String,
    what: What,
    most: f64,
    /// Whether the limit itself still fits.
    or_equal: bool,
}

/// Limits, and knobs that are fixed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Budget {
    limits: Vec<Limit>,
    format: Option<String>,
    stride: Option<u16>,
    kernel: Option<String>,
    model: Option<String>,
}

const EXPECTED: &str = "M0, M3, M4F or M7 (instructions a frame), the same with .event, flash, ram, frames, host or host.event with < or \
    <=, or format, stride, ln or model with =";

impl FromStr for Budget {
    type Err = String;

    /// Reads terms between commas. Names the term, what was found and what was expected.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut budget = Self::default();
        for term in text.split(',').map(str::trim) {
            let at = term.find(['<', '=']).ok_or_else(|| format!("term {term:?}: no limit, expected {EXPECTED}"))?;
            let (name, rest) = term.split_at(at);
            let name = name.trim();
            if let Some(value) = rest.strip_prefix('<') {
                let or_equal = value.starts_with('=');
                let value = value.strip_prefix('=').unwrap_or(value).trim();
                let what = what(name).ok_or_else(|| format!("term {term:?}: {name:?}, expected {EXPECTED}"))?;
                let most = number(value, &what).map_err(|error| format!("term {term:?}: {error}"))?;
                budget.limits.push(Limit { term: term.to_owned(), what, most, or_equal });
            } else {
                let value = rest.strip_prefix('=').unwrap_or(rest).trim();
                if budget.is_fixed(name) {
                    return Err(format!("term {term:?}: {name} a second time, expected it once"));
                }
                budget.fix(name, value).map_err(|error| format!("term {term:?}: {error}"))?;
            }
        }
        Ok(budget)
    }
}

fn what(name: &str) -> Option<What> {
    let name = name.to_ascii_lowercase();
    let core = |name: &str| Core::ALL.into_iter().find(|core| core.name().eq_ignore_ascii_case(name));
    if let Some((name, what)) = name.split_once('.') {
        let of_core = |core| if what == "event" { Some(What::Event(core)) } else { None };
        return match (name, what) {
            ("host", "event") => Some(What::HostEvent),
            _ => core(name).and_then(of_core),
        };
    }
    match name.as_str() {
        "flash" => Some(What::Flash),
        "ram" => Some(What::Ram),
        "frames" => Some(What::Frames),
        "host" => Some(What::Host),
        name => core(name).map(What::Frame),
    }
}

/// A number above 0: bytes in K of 1024, times in ns, us or ms, all else in k or M.
fn number(text: &str, what: &What) -> Result<f64, String> {
    let units: &[(&str, f64)] = match what {
        What::Flash | What::Ram => &[("K", 1024.0), ("k", 1024.0), ("M", 1_048_576.0), ("", 1.0)],
        What::Host | What::HostEvent => &[("ns", 1.0), ("us", 1e3), ("µs", 1e3), ("ms", 1e6), ("", 1.0)],
        What::Frames => &[("", 1.0)],
        What::Frame(_) | What::Event(_) => &[("k", 1e3), ("K", 1e3), ("M", 1e6), ("", 1.0)],
    };
    let read = units.iter().find_map(|(unit, scale)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        let scaled = number * scale;
        (scaled > 0.0 && scaled.is_finite()).then_some(scaled)
    });
    let names: Vec<&str> = units.iter().map(|(unit, _)| *unit).filter(|unit| !unit.is_empty()).collect();
    read.ok_or_else(|| match names[..] {
        [] => format!("{text:?}, expected a number above 0"),
        _ => format!("{text:?}, expected a number above 0, with or without {}", names.join(", ")),
    })
}

impl Budget {
    fn fix(&mut self, name: &str, value: &str) -> Result<(), String> {
        let one_of = |all: &[String]| match all.iter().find(|one| one.eq_ignore_ascii_case(value)) {
            Some(one) => Ok(Some(one.clone())),
            None => Err(format!("{value:?}, expected one of {}", all.join(", "))),
        };
        match name.to_ascii_lowercase().as_str() {
            "format" => {
                let names = Format::ALL.map(|format| format.name().to_owned());
                let either = value.eq_ignore_ascii_case("YUYV").then(|| Some("YUYV".to_owned()));
                self.format = either.map_or_else(|| one_of(&names), Ok)?;
            }
            "stride" => {
                let strides = STRIDES.map(|stride| stride.get().to_string());
                self.stride = one_of(&strides)?.and_then(|stride| stride.parse().ok());
            }
            "ln" => self.kernel = one_of(&KERNELS.map(|kernel| kernel_name(kernel).to_owned()))?,
            "model" if !value.is_empty() => self.model = Some(value.to_owned()),
            "model" => return Err("a name is missing, expected a model's, or none".to_owned()),
            other if what(other).is_some() => return Err(format!("{name} with =, expected < or <=")),
            _ => return Err(format!("{name:?}, expected {EXPECTED}")),
        }
        Ok(())
    }

    fn is_fixed(&self, name: &str) -> bool {
        match name.to_ascii_lowercase().as_str() {
            "format" => self.format.is_some(),
            "stride" => self.stride.is_some(),
            "ln" => self.kernel.is_some(),
            "model" => self.model.is_some(),
            _ => false,
        }
    }

    /// Whether the model that is asked for is of these rows, if one is asked for.
    ///
    /// # Errors
    /// The term, what was found, and the models' names.
    pub fn check_model(&self, rows: &[Row]) -> Result<(), String> {
        let Some(asked) = &self.model else { return Ok(()) };
        let mut names: Vec<&str> = vec![NONE];
        for name in rows.iter().filter_map(|row| row.model.as_deref().map(short)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        if names.contains(&short(asked)) {
            return Ok(());
        }
        Err(format!("term \"model={asked}\": {asked:?}, expected one of {}", names.join(", ")))
    }

    /// The cores that are named, or else `default`.
    pub fn cores(&self, default: Core) -> Vec<Core> {
        let of = |limit: &Limit| match limit.what {
            What::Frame(core) | What::Event(core) => Some(core),
            _ => None,
        };
        let mut cores: Vec<Core> = Vec::new();
        for core in self.limits.iter().filter_map(of) {
            if !cores.contains(&core) {
                cores.push(core);
            }
        }
        if cores.is_empty() {
            let bytes = self.limits.iter().any(|limit| matches!(limit.what, What::Flash | What::Ram));
            cores.extend(bytes.then_some(default));
        }
        cores
    }

    /// Whether a row has the knobs that are fixed.
    fn is_of(&self, row: &Row) -> bool {
        let format = row.setting.format;
        self.format.as_deref().is_none_or(|name| name == format.name() || format.pixels() == Some(name))
            && self.stride.is_none_or(|stride| stride == row.setting.stride.get())
            && self.kernel.as_deref().is_none_or(|name| name == kernel_name(row.setting.kernel))
            && self.model.as_deref().is_none_or(|name| short(name) == short(row.model.as_deref().unwrap_or(NONE)))
    }

    /// What a row takes of each limit, on each core: the limit's term, what it takes (nothing where that is not known),
    /// and the limit.
    fn taken<'a>(&'a self, row: &'a Row, prices: &'a Prices, default: Core) -> impl Iterator<Item = Taken<'a>> {
        let cores = self.cores(default);
        self.limits.iter().flat_map(move |limit| {
            let of_core = |core: Core, take: fn(&Price) -> i64| {
                let price = prices.of(core, &row.setting, row.model.as_deref());
                Taken { limit, core: Some(core), takes: price.map(|price| take(&price) as f64) }
            };
            let of_row = |takes| Taken { limit, core: None, takes };
            match limit.what {
                What::Frame(core) => vec![of_core(core, Price::frame)],
                What::Event(core) => vec![of_core(core, Price::event)],
                What::Flash => cores.iter().map(|core| of_core(*core, |price| price.flash)).collect(),
                What::Ram => cores.iter().map(|core| of_core(*core, |price| price.ram)).collect(),
                What::Frames => vec![of_row(row.found.latency)],
                What::Host => vec![of_row(row.host.map(|host| host.frame_ns))],
                What::HostEvent => vec![of_row(row.host.map(|host| host.event_ns))],
            }
        })
    }
}

struct Taken<'a> {
    limit: &'a Limit,
    core: Option<Core>,
    takes: Option<f64>,
}

impl Taken<'_> {
    fn fits(&self) -> bool {
        let Limit { most, or_equal, .. } = self.limit;
        self.takes.is_some_and(|takes| if *or_equal { takes <= *most } else { takes < *most })
    }

    /// How many times the limit; endlessly many where it is not known.
    fn ratio(&self) -> f64 {
        self.takes.map_or(f64::INFINITY, |takes| takes / self.limit.most)
    }
}

impl fmt::Display for Taken<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = match self.limit.what {
            What::Frame(_) => "instructions a frame",
            What::Event(_) => "instructions an event",
            What::Flash => "bytes of flash",
            What::Ram => "bytes of RAM",
            What::Frames => "frames to the answer",
            What::Host => "ns a frame on a host",
            What::HostEvent => "ns an event on a host",
        };
        if let Some(core) = self.core {
            write!(f, "{}: ", core.name())?;
        }
        match (self.takes, &self.limit.what) {
            (Some(takes), What::Frames) => write!(f, "{takes:.1} {unit}"),
            (Some(takes), _) => write!(f, "{} {unit}", grouped(takes as i64)),
            (None, _) => write!(f, "{unit} not known"),
        }?;
        write!(f, ", expected {}", self.limit.term)
    }
}

/// What is to be best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum By {
    /// Accuracy of specimens.
    #[default]
    Specimen,
    /// Accuracy of patterns.
    Pattern,
    /// Accuracy of depths.
    Depth,
    /// Error of speed, those without one counting as 100 %.
    Speed,
    /// Directions that are wrong or missing.
    Direction,
    /// Root mean square error of features of lit rows and columns.
    Features,
}

impl By {
    /// The higher, the better; nothing where it is not told.
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
            Self::Direction => Some(-(found.direction_errors as f64)),
            Self::Features => Some(-found.feature[1]),
        }
    }
}

/// The best row that fits; of several as good, the one that takes fewest instructions a second on the first core. MJPEG, which is
/// judged by fewer slides and so more by chance, only where nothing else fits.
///
/// # Errors
/// Where nothing fits: the nearest miss, or why there is none.
pub fn best<'r>(rows: &'r [Row], budget: &Budget, by: By, prices: &Prices, default: Core) -> Result<&'r Row, String> {
    let wanted: Vec<&Row> = rows.iter().filter(|row| budget.is_of(row) && by.score(row).is_some()).collect();
    let core = budget.cores(default).first().copied().unwrap_or(default);
    let a_second = |row: &Row| {
        let price = prices.of(core, &row.setting, row.model.as_deref());
        price.map_or(i64::MAX, |price| price.instructions_a_second())
    };
    let fit = wanted.iter().copied().filter(|row| budget.taken(row, prices, default).all(|taken| taken.fits()));
    let (mjpeg, others): (Vec<_>, Vec<_>) = fit.partition(|row| row.setting.format == Format::Mjpeg);
    let order = |a: &Row, b: &Row| {
        let by_score = by.score(a).partial_cmp(&by.score(b)).unwrap_or(std::cmp::Ordering::Equal);
        by_score.then_with(|| a_second(b).cmp(&a_second(a)))
    };
    let fit = if others.is_empty() { mjpeg } else { others };
    // Of equals the first, which is simpler.
    let best = fit.into_iter().reduce(|best, next| if order(next, best).is_gt() { next } else { best });
    best.ok_or_else(|| {
        let over = |row: &Row| budget.taken(row, prices, default).map(|taken| taken.ratio()).fold(0.0, f64::max);
        let nearest = wanted.iter().min_by(|a, b| over(a).total_cmp(&over(b)));
        nearest.map_or_else(|| budget.nothing(rows), |row| budget.nearest(row, prices, default))
    })
}

impl Budget {
    /// Why no row is even near.
    fn nothing(&self, rows: &[Row]) -> String {
        if rows.iter().any(|row| self.is_of(row)) {
            return "no configuration with these knobs tells what --by is about; without a model: --by speed, direction or \
                features"
                .to_owned();
        }
        "no configuration of the map has these knobs".to_owned()
    }

    fn nearest(&self, row: &Row, prices: &Prices, default: Core) -> String {
        let model = short(row.model.as_deref().unwrap_or(NONE));
        let missed = self.taken(row, prices, default).filter(|taken| !taken.fits());
        let missed: Vec<String> = missed.map(|taken| taken.to_string()).collect();
        format!("no configuration fits; the nearest is {}, model {model}: {}", row.setting, missed.join("; "))
    }
}

#[cfg(test)]
mod tests;
