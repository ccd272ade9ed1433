//! The names of pictures: the order, the times or numbers, and the series that they tell.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use wstac_core::rate::FrameRate;

use super::name_times::{NS_PER_S, OF_FRACTION, Part, date, decimal, number, of_clock, parts, seconds, time_of_day};
use super::replaced_rate::{self, readable};
use super::spacing::{self, Positions};

/// At most this part of names may be unlike the others.
const STRAY: usize = 10;
const NS_PER_MS: f64 = 1e6;
/// The seconds since 1970 of a time that a whole number in a name may be: from 2001 to 2128.
const EPOCH: std::ops::Range<i128> = 1_000_000_000..5_000_000_000;
/// The rates that times in names may have, in frames per second.
const RATES: std::ops::RangeInclusive<f64> = 0.5..=500.0;
/// The shortest time in 10⁻⁹ s between pictures whose names are times of day in one number.
const SHORTEST: i128 = 8_000_000;
/// Most series of pictures that are told apart.
const MOST_SERIES: usize = 16;
/// Each series has at least one in so many pictures.
const LEAST_OF_SERIES: usize = 20;

/// Returns the names and sizes of several series, such as those of two cameras; `None` if all pictures are of one.
pub(super) fn several(files: &[PathBuf], places: Option<&(Positions, Vec<f64>)>) -> Option<String> {
    if places.is_some_and(|(kind, _)| *kind == Positions::Numbers) {
        return None;
    }
    let series_by = |kept: Option<usize>| {
        let mut series = BTreeMap::<String, Vec<PathBuf>>::new();
        for file in files {
            let part = |(at, part): (usize, &Part<'_>)| match part {
                Part::Number(_) if kept != Some(at) => "#".into(),
                Part::Number(bytes) | Part::Text(bytes) => String::from_utf8_lossy(bytes).into_owned(),
            };
            series.entry(parts(stem(file)).iter().enumerate().map(part).collect()).or_default().push(file.clone());
        }
        // Minutes and hours are no series: what is left of such names is a time.
        let is_placed = |files: &[PathBuf]| {
            let is_own = |(own, _)| kept.is_none() || own == Positions::Numbers;
            places.is_none() && positions(files).is_some_and(is_own)
        };
        let is_series = |own: &Vec<PathBuf>| own.len() > 1 && own.len() >= files.len() / LEAST_OF_SERIES;
        let are_series = (2..=MOST_SERIES).contains(&series.len())
            && series.values().all(is_series)
            && (series.values().all(|own| is_placed(own)) || are_at_once(series.values(), kept));
        let said = |(name, files): (&String, &Vec<PathBuf>)| format!("{name}: {}", files.len());
        are_series.then(|| series.iter().map(said).collect::<Vec<_>>().join(", "))
    };
    // By their texts, or by one of their numbers.
    let columns = parts(stem(files.first()?)).len();
    std::iter::once(None).chain((0..columns).map(Some)).find_map(series_by)
}

/// Returns whether series have times since 1970, and two of them at once. `kept` is the number that tells them apart.
fn are_at_once<'a>(series: impl Iterator<Item = &'a Vec<PathBuf>>, kept: Option<usize>) -> bool {
    let span = |own: &Vec<PathBuf>| {
        let (unit, times) = Names::new(own)?.since_1970(kept)?;
        let at = |time: Option<&i128>| Some((*time? as f64 / unit) as i64);
        Some((at(times.iter().flatten().next())?, at(times.iter().flatten().next_back())?))
    };
    let Some(mut spans) = series.map(span).collect::<Option<Vec<_>>>() else { return false };
    spans.sort_unstable();
    spans.windows(2).any(|pair| pair[1].0 < pair[0].1)
}

/// Returns the rate of pictures, and what the description of their folder says of it and of their names. The rate is
/// the given one, or that of the times in their names, or else assumed.
pub(super) fn rate(places: Option<&(Positions, Vec<f64>)>, given: Option<FrameRate>) -> (FrameRate, String) {
    let own = places.and_then(|(kind, positions)| {
        let known: Vec<f64> = positions.iter().copied().filter(|position| !position.is_nan()).collect();
        let step = spacing::step(&known).filter(|_| *kind == Positions::NamedTimes)?;
        spacing::rate_of(step).filter(|rate| RATES.contains(&rate.per_second()))
    });
    let rate = given.or(own).unwrap_or(FrameRate::NOMINAL);
    let mut said = format!("{} frames per second{}", readable(rate), replaced_rate::remark(own, given));
    said += match (own, given) {
        (_, Some(_)) => "",
        (Some(_), None) => " by the times in their names",
        (None, None) => " (assumed: state another with --fps)",
    };
    if places.is_none() {
        said += "; the names do not say whether pictures are missing";
    }
    (rate, said)
}

/// Returns pictures in natural order, or by their numbers if all are decimals or hexadecimal, and their places.
pub(super) fn in_order(files: Vec<PathBuf>) -> (Vec<PathBuf>, Places) {
    if let Some(numbers) = hexadecimal(&files) {
        let counted: BTreeMap<i128, PathBuf> = numbers.into_iter().zip(files).collect();
        let (numbers, files): (Vec<_>, _) = counted.into_iter().map(|(number, file)| (Some(number), file)).unzip();
        return (files, placed(Positions::Numbers, 1.0, numbers));
    }
    let Some(times) = decimals(&files).or_else(|| by_clock(&files)) else {
        let places = by_parts(&files);
        return (files, places);
    };
    let mut timed: Vec<_> = times.into_iter().zip(files).collect();
    timed.sort_by_key(|(time, _)| *time);
    let (times, files) = timed.into_iter().unzip();
    (files, placed(Positions::NamedTimes, NS_PER_MS, times))
}

/// Returns the times of pictures of which some lack a fraction, so that their order is another: `01Z` is before
/// `01.040Z`.
fn by_clock(files: &[PathBuf]) -> Option<Vec<Option<i128>>> {
    let names = Names::new(files).filter(|names| names.lacks_fraction)?;
    let time = |name: &[Part<'_>]| date(name, OF_FRACTION, b"0").or_else(|| time_of_day(name));
    (0..names.usual.len()).find_map(|at| names.read(|name| time(name.get(at..)?)))
}

fn positions(files: &[PathBuf]) -> Places {
    in_order(files.to_vec()).1
}

/// Returns the places of pictures whose names are no decimals. They tell by dates with a fraction of a second, by the
/// only number that differs, by a number that rises by the same step, by a time of day, by a time since 1970, or by
/// seconds and their fraction.
fn by_parts(files: &[PathBuf]) -> Places {
    let names = Names::new(files)?;
    let index = || names.columns().find(|numbers| is_index(numbers));
    match names.differing[..] {
        [] => (files.len() == 1).then(|| (Positions::Numbers, vec![0.0])),
        [at] => {
            let numbers = names.column(at)?;
            // A counter such as 000000041 would be a clock of more frames per second than there are.
            let times = names.dates().or_else(|| names.since_1970(None)).or_else(|| names.with_unit(at));
            match times.or_else(|| names.clock(time_of_day).filter(|(_, times)| names.rise(times, SHORTEST))) {
                Some((unit, times)) => placed(Positions::NamedTimes, unit, times),
                None => placed(Positions::Numbers, 1.0, numbers),
            }
        }
        // A camera that slows down counts on: its times come before its numbers.
        _ => {
            let seconds = || names.parsed(names.differing.iter().copied(), seconds).filter(|_| index().is_none());
            match names.clear_times().or_else(seconds) {
                Some((unit, times)) => placed(Positions::NamedTimes, unit, times),
                None => placed(Positions::Numbers, 1.0, index()?),
            }
        }
    }
}

/// The positions of pictures by the numbers in their names, and what they are. That of a name that is not as the others
/// is not a number. `None` if the names do not tell.
pub(super) type Places = Option<(Positions, Vec<f64>)>;

/// Returns numbers of a kind as distances from the first one. Large numbers keep their differences.
fn placed(kind: Positions, unit: f64, numbers: Vec<Option<i128>>) -> Places {
    let first = numbers.iter().flatten().next().copied()?;
    let position = |number: Option<i128>| number.map_or(f64::NAN, |number| number.saturating_sub(first) as f64 / unit);
    Some((kind, numbers.into_iter().map(position).collect()))
}

/// The parts of pictures' names, nearly all of which differ only by numbers.
struct Names<'a> {
    parts: Vec<Vec<Part<'a>>>,
    /// The parts of a name that is as the others.
    usual: Vec<Part<'a>>,
    /// The numbers that differ.
    differing: Vec<usize>,
    /// Whether a time without a fraction is among them.
    lacks_fraction: bool,
}

/// Units per millisecond, and numbers that rise; `None` for a name that is not as the others.
type Times = (f64, Vec<Option<i128>>);

impl<'a> Names<'a> {
    fn new(files: &'a [PathBuf]) -> Option<Self> {
        let mut parts: Vec<Vec<Part<'_>>> = files.iter().map(|file| parts(stem(file))).collect();
        let usual = usual(&parts)?.to_vec();
        let lacks_fraction = parts.iter_mut().fold(false, |lacks, name| lacks | add_fraction(name, &usual));
        let differs = |at: &usize| parts.iter().any(|name| is_alike(name, &usual) && name.get(*at) != usual.get(*at));
        let differing = (0..usual.len()).filter(differs).collect();
        Some(Self { parts, usual, differing, lacks_fraction })
    }

    /// Returns the numbers that names have; `None` if one cannot be read, which is no stray name.
    fn read(&self, number: impl Fn(&[Part<'_>]) -> Option<i128>) -> Option<Vec<Option<i128>>> {
        let read = |name: &Vec<Part<'_>>| if is_alike(name, &self.usual) { number(name).map(Some) } else { Some(None) };
        self.parts.iter().map(read).collect()
    }

    fn column(&self, at: usize) -> Option<Vec<Option<i128>>> {
        self.read(|name| number(name.get(at)?.digits()?))
    }

    /// Returns the numbers that differ and can be read.
    fn columns(&self) -> impl Iterator<Item = Vec<Option<i128>>> {
        self.differing.iter().filter_map(|at| self.column(*at))
    }

    /// Returns the times that names have from one of these parts on, in parts of 10⁻⁹ s, if they rise.
    fn parsed(
        &self,
        mut starts: impl Iterator<Item = usize>,
        time: impl Fn(&[Part<'_>]) -> Option<i128>,
    ) -> Option<Times> {
        let times =
            starts.find_map(|at| self.read(|name| time(name.get(at..)?)).filter(|times| self.rise(times, 1)))?;
        Some((NS_PER_MS, times))
    }

    /// Returns the times of dates. What begins with a zero and counts on is none.
    fn dates(&self) -> Option<Times> {
        let of = |counts: &[usize], short: &[u8], least| {
            self.clock(|name| date(name, counts, short)).filter(|(_, times)| self.rise(times, least))
        };
        let hundredths = || of(&[2], b"1", 20_000_000).filter(|(_, times)| are_hundredths(times));
        of(OF_FRACTION, b"1", 1).or_else(|| of(OF_FRACTION, b"0", SHORTEST)).or_else(hundredths)
    }

    /// Returns whether numbers rise by at least this each time. A few may be equal, which come unevenly, if names count
    /// on: else they are of two cameras.
    fn rise(&self, numbers: &[Option<i128>], least: i128) -> bool {
        let known: Vec<i128> = numbers.iter().flatten().copied().collect();
        let steps = || known.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
        let equal = steps().filter(|step| *step == 0).count();
        let are_few = || STRAY * equal <= known.len() && self.columns().any(|numbers| is_index(&numbers));
        steps().all(|step| step == 0 || step >= least) && (equal == 0 || are_few())
    }

    /// Returns the times of a clock, whose first parts may be those of all.
    fn clock(&self, time: impl Fn(&[Part<'_>]) -> Option<i128>) -> Option<Times> {
        self.parsed(0..self.usual.len(), time)
    }

    /// Returns times since 1970: whole ones, or seconds and their fraction, which is not the number at `kept`: at 15
    /// frames per second, each second has the same fractions.
    fn since_1970(&self, kept: Option<usize>) -> Option<Times> {
        let whole = self.columns().find_map(|numbers| Some((epoch_unit(&numbers)?, numbers)));
        let is_time = |time: &i128| EPOCH.contains(&(time / NS_PER_S));
        let starts = (0..self.usual.len()).filter(|at| kept != Some(at + 2));
        let fractions = || self.parsed(starts, |name| seconds(name).filter(is_time));
        whole.filter(|(_, times)| self.rise(times, 1)).or_else(fractions)
    }

    /// Returns the numbers of a column behind which their unit stands.
    fn with_unit(&self, at: usize) -> Option<Times> {
        let units: [(&[u8], f64); 3] = [(b"ms", 1.0), (b"us", 1e3), (b"ns", NS_PER_MS)];
        let Some(Part::Text(behind)) = self.usual.get(at + 1) else { return None };
        let (_, unit) = units.into_iter().find(|(unit, _)| behind == unit)?;
        Some((unit, self.column(at)?)).filter(|(_, times)| self.rise(times, 1))
    }

    /// Returns the times that names state in a form that nothing else has.
    fn clear_times(&self) -> Option<Times> {
        let of_units = || self.differing.iter().find_map(|at| self.with_unit(*at));
        // 1700000000.5000 is no time of day, at 17:00:00.
        let dated = self.dates().or_else(|| self.since_1970(None));
        dated.or_else(|| self.clock(time_of_day)).or_else(of_units)
    }
}

/// Returns whether the hundredths of times are no counter: they begin again, and are of more than 60 or not evenly
/// apart.
fn are_hundredths(times: &[Option<i128>]) -> bool {
    let own: Vec<_> = times.iter().map(|time| time.map(|time| time / 10_000_000 % 100)).collect();
    let known: Vec<i128> = own.iter().flatten().copied().collect();
    let steps = || known.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0);
    let least = steps().min().unwrap_or(1);
    !is_index(&own) && (known.iter().any(|number| *number >= 60) || steps().any(|step| step % least != 0))
}

/// Returns the units per millisecond of numbers that are whole times since 1970: milliseconds, microseconds or
/// nanoseconds.
fn epoch_unit(numbers: &[Option<i128>]) -> Option<f64> {
    let is_time = |per_s: &i128| numbers.iter().flatten().all(|number| EPOCH.contains(&(number / per_s)));
    let per_s = [1000, 1_000_000, NS_PER_S].into_iter().find(is_time)?;
    let first = numbers.iter().flatten().next()?;
    let known: Vec<f64> = numbers.iter().flatten().map(|number| (number - first) as f64).collect();
    let rate = per_s as f64 / spacing::step(&known)?;
    RATES.contains(&rate).then_some(per_s as f64 / 1000.0)
}

/// Returns the numbers of names that are a counter of one width in hexadecimal, such as `0000000a`.
fn hexadecimal(files: &[PathBuf]) -> Option<Vec<i128>> {
    let width = stem(files.first()?).len();
    let value = |file: &PathBuf| {
        let name = str::from_utf8(stem(file)).ok().filter(|name| name.len() == width && !name.starts_with('+'))?;
        i128::from_str_radix(name, 16).ok()
    };
    let numbers: Vec<i128> = files.iter().map(value).collect::<Option<_>>()?;
    // The letter of `f0001` is no digit: all have it.
    let first = stem(files.first()?);
    let is_shared = |at: usize| files.iter().all(|file| stem(file).get(at) == first.get(at));
    let shared = (0..width).take_while(|at| is_shared(*at)).count();
    let has = |is_of: fn(&u8) -> bool| files.iter().any(|file| stem(file).iter().skip(shared).any(is_of));
    let mut sorted: Vec<_> = numbers.iter().copied().map(Some).collect();
    sorted.sort_unstable();
    (has(u8::is_ascii_digit) && has(u8::is_ascii_alphabetic) && is_index(&sorted)).then_some(numbers)
}

/// Returns the decimals of names that consist of them alone, apart from what all have at their start and end, in parts
/// of 10⁻⁹.
fn decimals(files: &[PathBuf]) -> Option<Vec<Option<i128>>> {
    let first = stem(files.first()?);
    let (mut start, mut end) = (first.len(), first.len());
    for file in files {
        let name = stem(file);
        start = start.min(name.iter().zip(first).take_while(|(a, b)| a == b).count());
        end = end
            .min(name.iter().rev().zip(first.iter().rev()).take_while(|(a, b)| a == b && !a.is_ascii_digit()).count());
    }
    let is_of_number = |byte: &u8| byte.is_ascii_digit() || *byte == b'.';
    let shared = first.get(..start)?;
    start -= shared.iter().rev().take_while(|byte| is_of_number(byte)).count();
    // The number of `cam1.0007` is 7.
    if shared.get(..start)?.last().is_some_and(u8::is_ascii_alphabetic) {
        return None;
    }
    let texts: Option<Vec<_>> =
        files.iter().map(|file| stem(file).get(start..stem(file).len().checked_sub(end)?)).collect();
    let texts = texts?;
    let fractions = || texts.iter().filter_map(|text| text.rsplit(|byte| *byte == b'.').next());
    // Without zeros in front, nanoseconds of `1700000000.33333333` are a number, as ROS writes them.
    let is_nanoseconds = fractions().any(|digits| digits.len() == 9)
        && fractions().any(|digits| digits.len() < 8)
        && fractions().all(|digits| digits == b"0" || !digits.starts_with(b"0"));
    let digits = if is_nanoseconds { 9 } else { 0 };
    let times: Vec<_> = texts.iter().map(|text| decimal(text, digits)).collect::<Option<_>>()?;
    // Times of day, such as 104158.520, unless seconds go on above 59.
    let clock: Option<Vec<_>> = times.iter().map(|time| of_clock(*time)).collect();
    Some(clock.unwrap_or(times).into_iter().map(Some).collect())
}

/// Returns the name that nearly all are like: they differ only by numbers.
fn usual<'a, 'b>(names: &'a [Vec<Part<'b>>]) -> Option<&'a [Part<'b>]> {
    // If a stray one is like none, one of the next is like nearly all.
    let is_usual = |usual: &&Vec<Part<'_>>| {
        let alike = names.iter().filter(|name| is_alike(name, usual)).count();
        names.len() - alike <= names.len() / STRAY
    };
    names.iter().step_by((names.len() / 16).max(1)).find(is_usual).map(Vec::as_slice)
}

/// Adds the fraction that Python leaves out of a time if it is 0. Returns whether it did.
fn add_fraction<'a>(name: &mut Vec<Part<'a>>, usual: &[Part<'a>]) -> bool {
    let at = name.iter().zip(usual).take_while(|(a, b)| a.digits().is_some() || a == b).count();
    let lacks_it = name.len() + 2 == usual.len() && usual.get(at) == Some(&Part::Text(b"."));
    if lacks_it {
        name.splice(at..at, [Part::Text(b"."), Part::Number(b"000000")]);
    }
    lacks_it
}

fn is_alike(a: &[Part<'_>], b: &[Part<'_>]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|pair| match pair {
            (Part::Text(a), Part::Text(b)) => a == b,
            (Part::Number(_), Part::Number(_)) => true,
            _ => false,
        })
}

/// Returns whether numbers rise, by the same step or several of it, and mostly by one.
fn is_index(numbers: &[Option<i128>]) -> bool {
    let known: Vec<i128> = numbers.iter().flatten().copied().collect();
    let distances: Vec<i128> = known.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    let mut sorted = distances.clone();
    sorted.sort_unstable();
    let Some(step) = sorted.get(sorted.len() / 2).copied().filter(|step| *step > 0) else { return false };
    let is_whole = |distance: &i128| *distance > 0 && distance % step == 0;
    let once = distances.iter().filter(|distance| **distance == step).count();
    distances.iter().all(is_whole) && 2 * once > distances.len()
}

/// Returns a file's name without its ending.
pub(super) fn stem(file: &Path) -> &[u8] {
    file.file_stem().unwrap_or_default().as_encoded_bytes()
}

#[cfg(test)]
mod tests {
    use super::Positions::{NamedTimes, Numbers};
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    fn found(names: &[&str]) -> Option<Vec<f64>> {
        positions(&paths(names)).map(|(_, positions)| positions)
    }

    /// Returns what places 130 pictures, and the place of the last, after it was checked that they are in their order.
    fn last(name: &dyn Fn(u64) -> PathBuf) -> (Positions, f64) {
        let mut files: Vec<_> = (0..130).map(name).collect();
        files.sort_by_cached_key(|file| (crate::source::natural::key(stem(file)), file.clone()));
        let (files, places) = in_order(files);
        assert_eq!(files, (0..130).map(name).collect::<Vec<_>>());
        let (kind, places) = places.unwrap();
        (kind, places[129])
    }

    #[test]
    fn pictures_are_placed_by_the_one_number_that_differs() {
        assert_eq!(found(&["a8.png", "a09.png", "a10.png"]), Some(vec![0.0, 1.0, 2.0]));
        assert_eq!(found(&["2_frame1.png", "2_frame3_.png"]), None);
        assert_eq!(found(&["cam1.0007.png", "cam1.0009.png"]), Some(vec![0.0, 2.0]));
        assert_eq!(found(&["0.5.png", "0.75.png", "1.0.png"]), Some(vec![0.0, 250.0, 500.0]));
        assert_eq!(found(&["1764100000000000001.png", "1764100000000000003.png"]), Some(vec![0.0, 2.0]));
        assert_eq!(found(&["a.png", "b.png"]), None);
        let decimal = |name: &str| decimals(&paths(&[name, "img_10.0.png"])).unwrap()[0];
        assert!(decimal("img_9.5.png") > decimal("img_9.45.png"));
        assert_eq!(found(&["1.png"]), Some(vec![0.0]));
        assert_eq!(found(&[&"9".repeat(99), &"8".repeat(99)]), None);
    }

    #[test]
    fn of_several_numbers_an_index_or_a_time_places_pictures() {
        // Every frame of 60 but those of odd numbers from 20 to 40, 30 per second from 59.2 s on.
        let placed = |name: &dyn Fn(u64, u64) -> String| {
            let kept = (0..60).filter(|frame| !(20..40).contains(frame) || frame % 2 == 0);
            let files: Vec<_> = kept.map(|frame| PathBuf::from(name(frame, 59_200 + frame * 100 / 3))).collect();
            let stray = files.iter().position(|file| file.starts_with("background.png"));
            let (kind, found) = positions(&files).unwrap_or_else(|| panic!("{files:?}"));
            let step = spacing::step(&found.iter().copied().filter(|position| !position.is_nan()).collect::<Vec<_>>())
                .unwrap();
            let gaps = found.windows(2).filter(|pair| ((pair[1] - pair[0]) / step).round() as u32 == 2).count();
            (kind, (step * 10.0).round() / 10.0, gaps, stray.map(|at| found[at].is_nan()))
        };
        let clock = |ms: u64| (12 + ms / 60_000, ms / 1000 % 60, ms % 1000);
        let at = |ms| {
            let (minute, second, ms) = clock(ms);
            format!("{minute:02}-{second:02}-{ms:03}")
        };
        let time = |frame: u64| 1_764_100_001_533 + frame * 100 / 3;
        for (expected, name) in [
            (
                (NamedTimes, 33.3, 10, None),
                &(|frame, _| format!("frame{frame:05}_{}.{:03}.png", time(frame) / 1000, time(frame) % 1000))
                    as &dyn Fn(u64, u64) -> String,
            ),
            ((NamedTimes, 33.3, 10, None), &|frame, ms| format!("{frame:05}_{ms}ms.png")),
            ((NamedTimes, 33.3, 10, None), &|_, ms| format!("2025-11-25_12-{}.png", at(ms))),
            ((NamedTimes, 33.3, 10, None), &|_, ms| format!("2025112512{}.png", at(ms).replace('-', ""))),
            ((NamedTimes, 33.3, 10, None), &|frame, _| {
                format!("img_{}.{:06}.png", time(frame) / 1000, time(frame) % 1000 * 1000)
            }),
            ((NamedTimes, 33.3, 10, None), &|frame, _| {
                format!("{}_{:09}.png", time(frame) / 1000, time(frame) % 1000 * 1_000_000)
            }),
            ((NamedTimes, 33.3, 10, None), &|_, ms| format!("cam_251125_12{}.png", at(ms).replacen('-', "", 1))),
            ((NamedTimes, 33.3, 10, Some(true)), &|frame, ms| {
                if frame == 0 { "background.png".into() } else { format!("2025-11-25_12-{}.png", at(ms)) }
            }),
            ((NamedTimes, 33.3, 10, Some(true)), &|frame, ms| {
                if frame == 0 { "background.png".into() } else { format!("{ms}ms.png") }
            }),
            ((Numbers, 1.0, 9, Some(true)), &|frame, _| {
                if frame == 30 { "background.png".into() } else { format!("{frame}.png") }
            }),
        ] {
            let (kind, step, gaps, stray) = placed(name);
            assert_eq!((kind, step, stray), (expected.0, expected.1, expected.3), "{}", name(5, 59_300));
            assert!(gaps.abs_diff(expected.2) <= 1, "{gaps}: {}", name(5, 59_300));
        }
    }

    #[test]
    fn times_beside_an_index_give_the_rate() {
        for (name, is_known) in [
            (
                &(|n: u64| format!("frame{n:05}_{}.png", 1_764_100_001_533 + n * 1000 / 60)) as &dyn Fn(u64) -> String,
                true,
            ),
            (&|n| format!("{n:05}-{}.png", 1_764_100_001_533_000 + n * 1_000_000 / 60), true),
            (&|n| format!("{}_{n}.png", 1_764_100_001_533 + n * 1000 / 60), true),
            (&|n| format!("{n}_{}ms.png", n * 1000 / 60), true),
            (&|n| format!("{}ms.png", n * 1000 / 60), true),
            (&|n| format!("{n}_{}.png", n * n), false),
        ] {
            let files: Vec<_> = (0..130).map(|n| PathBuf::from(name(n))).collect();
            let (rate, said) = rate(positions(&files).as_ref(), None);
            assert_eq!((rate.per_second() - 60.0).abs() < 0.6, is_known, "{}: {said}", name(5));
            assert_eq!(said.contains("assumed"), !is_known, "{said}");
        }
    }

    #[test]
    fn times_of_day_go_on_over_a_minute() {
        for between in ["-", ":", "_", ""] {
            let name = |n: u64| {
                let ms = 41 * 60_000 + 58_520 + n * 100 / 3;
                let [minute, second, ms] = [ms / 60_000, ms / 1000 % 60, ms % 1000];
                PathBuf::from(format!("10{between}{minute:02}{between}{second:02}.{ms:03}.png"))
            };
            let files: Vec<_> = (0..130).map(name).collect();
            let (kind, places) = positions(&files).unwrap();
            assert_eq!((kind, places[129]), (NamedTimes, 4300.0), "{between}");
        }
    }

    #[test]
    fn a_fraction_may_be_short_or_left_out() {
        for (step, zone) in [(33, ""), (40, "+00:00"), (10, "Z")] {
            let name = |n: u64| {
                let [second, ms] = [58 + n * step / 1000, n * step % 1000];
                let fraction = if ms == 0 { String::new() } else { format!(".{ms:03}000") };
                PathBuf::from(format!("2026-11-27T10:{:02}:{:02}{fraction}{zone}.png", second / 60, second % 60))
            };
            assert_eq!(last(&name), (NamedTimes, (129 * step) as f64), "{step}");
        }
        for (before, point) in [("2026-11-27_10-00-", "."), ("10-00-", "."), ("20261127T1000", "."), ("10.00.", ",")] {
            for digits in [2, 4, 7, 8] {
                let zeros = "0".repeat(digits - 2);
                let name = |n| format!("{before}{:02}{point}{:02}{zeros}.png", n / 25, n % 25 * 4);
                let files: Vec<_> = (0..130).map(|n| PathBuf::from(name(n))).collect();
                let (kind, places) = positions(&files).unwrap();
                assert_eq!((kind, places[129]), (NamedTimes, 5160.0), "{}", name(3));
            }
        }
        let hundredths = |n: u64| PathBuf::from(format!("20250102_0304{:02}_{:02}.png", n / 25, n % 25 * 4));
        assert_eq!(last(&hundredths), (NamedTimes, 5160.0));
        // Two pictures of one time come unevenly.
        let equal = |n| PathBuf::from(format!("{n:03}_{}", hundredths(n - u64::from(n == 60)).display()));
        let places = positions(&(0..130).map(equal).collect::<Vec<_>>()).unwrap().1;
        assert_eq!((places[60], places[61]), (places[59], places[59] + 80.0));
        // One in eleven has a second camera.
        let cameras = (0..130).flat_map(|n| (1..=1 + u64::from(n % 11 == 0)).map(move |camera| (n, camera)));
        let of_two = cameras.map(|(n, camera)| PathBuf::from(format!("20250102_0304{n:05}_{camera}.png")));
        assert_eq!(positions(&of_two.collect::<Vec<_>>()), None);
        let counted = |n| PathBuf::from(format!("000123_000456_{}.png", 789 + n));
        assert_eq!(last(&counted), (Numbers, 129.0));
        let early = |n: u64| PathBuf::from(format!("090102_0304{:02}_{:03}.png", n / 25, n % 25 * 40));
        assert_eq!(last(&early), (NamedTimes, 5160.0));
        // The number of a picture in its second is no fraction, nor is every second or third of them.
        for step in [1, 2, 3] {
            let name = |n| PathBuf::from(format!("20261127_1000{:02}_{:02}.png", n / 10, n % 10 * step));
            assert_eq!(positions(&(0..130).map(name).collect::<Vec<_>>()), None);
        }
    }

    #[test]
    fn numbers_of_one_width_or_without_zeros_are_placed() {
        let last = |name: &dyn Fn(u64) -> String| last(&|n| PathBuf::from(name(n)));
        assert_eq!(last(&|n| format!("{n:08x}.png")), (Numbers, 129.0));
        for before in ["f", "c", "cafe"] {
            assert_eq!(last(&|n| format!("{before}{n:04}.png")), (Numbers, 129.0));
        }
        for step in [1, 2, 5] {
            assert_eq!(last(&|n| format!("{:09}.png", step * n)), (Numbers, (step * 129) as f64));
            assert_eq!(last(&|n| format!("{:012}.png", step * n)), (Numbers, (step * 129) as f64));
        }
        let ns = |n: u64| (1_700_000_000 + n / 30, n % 30 * 1_000_000_000 / 30);
        assert_eq!(last(&|n| format!("{}.{}.png", ns(n).0, ns(n).1)), (NamedTimes, 4300.0));
        let of_day = |s: u64, ms| format!("10{:02}{:02}{ms:03}.png", 41 + s / 60, s % 60);
        assert_eq!(last(&|n| of_day(57 + n / 25, n % 25 * 40)), (NamedTimes, 5160.0));
    }

    #[test]
    fn names_that_do_not_tell_are_said() {
        let said = |names: &[&str]| rate(positions(&paths(names)).as_ref(), None).1;
        assert_eq!(said(&["1.png", "2.png"]), "30:1 frames per second (assumed: state another with --fps)");
        assert!(!said(&["a.png"]).contains("names"));
        for names in [&["1_7.png", "1_9.png", "2_3.png"][..], &["a.png", "b.png", "c.png"]] {
            assert!(said(names).ends_with("; the names do not say whether pictures are missing"));
        }
    }

    #[test]
    fn times_in_names_give_the_rate() {
        let rate_of = |name: &dyn Fn(u32) -> String| {
            let files: Vec<_> =
                (0..50).filter(|frame| frame % 7 != 0).map(|frame| PathBuf::from(name(frame))).collect();
            let (rate, said) = rate(positions(&files).as_ref(), None);
            assert_eq!(said.contains("by the times in their names"), !said.contains("assumed"), "{said}");
            // In tenths.
            (rate.per_second() * 10.0).round() as u32
        };
        for fps in [15_u32, 25, 60, 120] {
            let ms = |frame: u32| 1_764_100_001_533 + u64::from(frame * 1000 / fps);
            assert!(rate_of(&|frame| format!("{}.png", ms(frame))).abs_diff(10 * fps) < 3);
            let us = |frame: u32| 1_764_100_001_533_000 + u64::from(frame * 1_000_000 / fps);
            assert_eq!(rate_of(&|frame| format!("left_{}.png", us(frame))), 10 * fps);
            assert_eq!(rate_of(&|frame| format!("{}000.png", us(frame))), 10 * fps);
            assert_eq!(rate_of(&|frame| format!("{:.4}.png", 9.9 + f64::from(frame) / f64::from(fps))), 10 * fps);
        }
        // Numbers of that size that are no times.
        assert_eq!(rate_of(&|frame| format!("{}.png", 1_764_100_001_533_u64 + u64::from(frame))), 300);
        let (rate, said) =
            rate(positions(&paths(&["1.00.png", "1.04.png", "1.08.png"])).as_ref(), Some(FrameRate::NOMINAL));
        assert_eq!((rate, &*said), (FrameRate::NOMINAL, "30:1 frames per second as --fps says; without it, 25:1"));
    }

    #[test]
    fn several_series_are_told_apart() {
        let of = |name: &dyn Fn(u32) -> [String; 2]| {
            let files: Vec<_> = (0..130).flat_map(name).map(PathBuf::from).collect();
            several(&files, positions(&files).as_ref())
        };
        let expected = Some("left_#: 130, right_#: 130");
        assert_eq!(of(&|n| [format!("left_{n:04}.png"), format!("right_{n:04}.png")]).as_deref(), expected);
        assert_eq!(of(&|n| [format!("{n}_a.png"), format!("{n}_b.png")]).as_deref(), Some("#_a: 130, #_b: 130"));
        let expected = Some("cam1_#: 130, cam2_#: 130");
        assert_eq!(of(&|n| [format!("cam1_{n:04}.png"), format!("cam2_{n:04}.png")]).as_deref(), expected);
        let ms = |n: u32, late| 1_764_100_001_533 + u64::from(n) * 100 / 3 + late;
        let expected = Some("0_#: 130, 1_#: 130");
        assert_eq!(of(&|n| [format!("0_{}.png", ms(n, 0)), format!("1_{}.png", ms(n, 7))]).as_deref(), expected);
        let expected = Some("#_0: 130, #_1: 130");
        assert_eq!(of(&|n| [format!("{}_0.png", ms(n, 0)), format!("{}_1.png", ms(n, 7))]).as_deref(), expected);
        let at = |n: u32, late| format!("{}.{:06}", ms(n, late) / 1000, ms(n, late) % 1000 * 1000);
        let expected = Some("cam0_#.#: 130, cam1_#.#: 130");
        assert_eq!(of(&|n| [format!("cam0_{}.png", at(n, 0)), format!("cam1_{}.png", at(n, 16))]).as_deref(), expected);
        assert!(of(&|n| [format!("{}_cam0.png", at(n, 0)), format!("{}_cam1.png", at(n, 16))]).is_some());
        assert_eq!(of(&|n| [format!("{}.png", at(2 * n, 0)), format!("{}.png", at(2 * n + 1, 0))]), None);
        // One series: a counter and the time, takes one after the other, names with hours, minutes and seconds, and
        // names without an order.
        assert_eq!(of(&|n| [0, 500].map(|ms| format!("12_{:02}_{:02}_{ms:03}.png", n / 60, n % 60))), None);
        assert_eq!(of(&|n| [2 * n, 2 * n + 1].map(|n| format!("{n:05}_{}.png", at(n, 0)))), None);
        assert_eq!(of(&|n| [0_u64, 1].map(|take| format!("{take}_{}.png", ms(n, take * 9000)))), None);
        assert_eq!(of(&|n| [2 * n, 2 * n + 1].map(|n| format!("{:x}.png", n * 2_654_435))), None);
        assert_eq!(several(&paths(&["a.png", "b.png"]), None), None);
    }

    #[test]
    fn fractions_that_each_second_has_are_no_series() {
        for fps in [10, 12, 15, 16] {
            let at = |n: u32| format!("{}.{:04}", 1_700_000_000 + n / fps, (n % fps * 10_000 + fps / 2) / fps);
            let names: [&dyn Fn(u32) -> String; 3] =
                [&|n| format!("{}.png", at(n)), &|n| format!("frame{n:05}_{}.png", at(n)), &|n| {
                    format!("{}_{:03}.png", 1_700_000_000 + n / fps, n % fps * 1000 / fps)
                }];
            for name in names {
                let files: Vec<_> = (0..130).map(|n| PathBuf::from(name(n))).collect();
                let places = positions(&files);
                assert_eq!(several(&files, places.as_ref()), None, "{}", name(1));
                let rate = rate(places.as_ref(), None).0.per_second();
                assert!((rate / f64::from(fps) - 1.0).abs() < 0.01, "{}: {rate}", name(1));
            }
            // Two cameras at once are two series all the same.
            let of_two = (0..130).flat_map(|n| [0, 1].map(|camera| PathBuf::from(format!("{}_{camera}.png", at(n)))));
            let files: Vec<_> = of_two.collect();
            let found = several(&files, positions(&files).as_ref());
            assert_eq!(found.as_deref(), Some("#.#_0: 130, #.#_1: 130"), "{fps}");
        }
    }
}
