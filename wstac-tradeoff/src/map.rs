//! Rows as comma-separated values, written and read: the map that comes with the program, and the results of a sweep.

use std::cmp::Ordering;
use std::fmt::Write;
use std::str::FromStr;

use wstac_core::frame::Stride;

use super::candidate::{Candidate, NONE};
use super::parameters::{AnswerLaw, Format, KERNELS, STRIDES, Setting, kernel_name};
use super::prices::{Core, Prices, inflated};
use super::row::{Found, Row};
use super::statistics::Interval;
use wstac_host::error::{Error, ErrorKind};

/// The map that comes with the program, compressed.
const KEPT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/map.csv"));
/// The name of the map in messages.
const ABOUT: &str = "map.csv";

/// Columns of the results.
const FOUND: &str = "format,stride,ln,law,model,slides,events,specimen,specimen_low,specimen_high,pattern,pattern_low,\
    pattern_high,depth,depth_low,depth_high,speed_error,speed_error_p95,speed_slides,speed_missing,direction_errors,\
    feature_max_lit,feature_rms_lit,feature_max,feature_rms,latency,objects";
/// Columns of the facts about a model.
const MODEL: &str = "kind,weights,trees,depth,frames,bytes";

/// Returns the map that comes with the program.
///
/// # Errors
/// This does not fail: a test reads it.
pub fn kept() -> Result<Vec<Row>, Error> {
    read(ABOUT, &inflated(ABOUT, KEPT)?)
}

/// Formats rows as a map.
pub fn write(rows: &[Row]) -> String {
    let lines = std::iter::once(FOUND.to_owned()).chain(rows.iter().map(found));
    lines.map(|line| line + "\n").collect()
}

/// Formats rows as a map with the facts about the models and every core's price.
pub fn write_all(rows: &[Row], models: &[Candidate], prices: &Prices) -> String {
    let of_core =
        |core: Core| ["frame", "event", "flash", "ram"].map(|what| format!("{}_{what}", core.name())).join(",");
    let mut text = format!("{FOUND},{MODEL},{}\n", Core::ALL.map(of_core).join(","));
    for row in rows {
        let model = models.iter().find(|model| Some(&model.name) == row.model.as_ref());
        // Writing to a string does not fail.
        let _ = write!(text, "{},{}", found(row), model.map_or_else(|| ",,,,,".to_owned(), about));
        for core in Core::ALL {
            let price = prices.of(core, &row.setting, row.model.as_deref());
            let all = price.map(|price| [Some(price.frame()), price.event(), price.flash, price.ram]);
            let numbers = all.unwrap_or_default().into_iter();
            text.extend(numbers.map(|number| number.map_or_else(|| ",".to_owned(), |number| format!(",{number}"))));
        }
        text.push('\n');
    }
    text
}

/// Lists the columns of a claim in which another run differs: name, claimed, found.
pub fn differences(claim: &Row, again: &Row) -> String {
    let (claim, again) = (found(claim), found(again));
    let all = FOUND.split(',').zip(claim.split(',').zip(again.split(',')));
    let differing = all.filter(|(_, (claim, again))| claim != again);
    differing.map(|(name, (claim, again))| format!("{name} {claim}, found {again}")).collect::<Vec<_>>().join("; ")
}

/// Returns the names of the values of [`found`].
pub fn found_header() -> &'static str {
    FOUND
}

/// Formats the results of a row for an exact comparison.
pub fn found(row: &Row) -> String {
    let Found { slides, events, accuracy, speed, speed_slides, speedless, direction_errors, feature, .. } = row.found;
    let known = |number: Option<f64>, digits| number.map_or_else(String::new, |number| format!("{number:.digits$}"));
    let mut fields = row.setting.names().to_vec();
    fields.extend([row.model.clone().unwrap_or_else(|| NONE.to_owned()), slides.to_string(), events.to_string()]);
    for interval in accuracy {
        let ends = interval.map(|found| [found.mean, found.low, found.high]);
        fields.extend((0..3).map(|at| known(ends.map(|ends| ends[at]), 2)));
    }
    fields.extend((0..2).map(|at| known(speed.map(|speed| speed[at]), 2)));
    fields.extend([speed_slides, speedless, direction_errors].map(|count| count.to_string()));
    fields.extend(feature.map(|error| known(Some(error), 6)));
    fields.extend([row.found.latency, row.found.objects].map(|number| known(number, 1)));
    fields.join(",")
}

fn about(model: &Candidate) -> String {
    let about = &model.about;
    let kind = about.kind.to_string().replace(',', ":");
    let trees = about.trees.as_ref().map_or_else(|| ",".to_owned(), |trees| format!("{},{}", trees.count, trees.depth));
    format!("{kind},{},{trees},{},{}", about.numbers, about.frames, about.bytes)
}

/// Reads a map; `about` names its file.
///
/// # Errors
/// The map is not valid; the message names the line, the column, the value found and the values expected.
pub fn read(about: &str, text: &str) -> Result<Vec<Row>, Error> {
    let mut lines = text.lines();
    let header = lines.next().unwrap_or_default();
    let wrong = |what: &dyn std::fmt::Display| Err(Error::new(ErrorKind::Format, about, what));
    if header.starts_with(&format!("{FOUND},{MODEL}")) {
        return wrong(&"a table of all numbers (trade.csv), expected the map that a sweep writes beside it (map.csv)");
    }
    if header != FOUND {
        return wrong(&format_args!("line 1: {header:?}, expected {FOUND}; help: wstac trade makes another map"));
    }
    let numbered = (2..).zip(lines);
    let row = |(number, line)| {
        line_of(line, header)
            .map_err(|error| Error::new(ErrorKind::Format, about, format_args!("line {number}: {error}")))
    };
    numbered.map(row).collect()
}

/// One line's fields, read one by one.
struct Fields<'a> {
    fields: std::str::Split<'a, char>,
    names: std::str::Split<'a, char>,
}

impl<'a> Fields<'a> {
    fn text(&mut self) -> Result<(&'a str, &'a str), String> {
        let name = self.names.next().unwrap_or_default();
        self.fields.next().map(|field| (field, name)).ok_or_else(|| format!("{name} is missing"))
    }

    fn one_of<T: Copy>(&mut self, all: &[T], name_of: impl Fn(T) -> String) -> Result<T, String> {
        let (found, name) = self.text()?;
        let names = || all.iter().map(|one| name_of(*one)).collect::<Vec<_>>().join(", ");
        let one = all.iter().copied().find(|one| name_of(*one) == found);
        one.ok_or_else(|| format!("{name} is {found:?}, expected one of {}", names()))
    }

    fn number<T: FromStr>(&mut self) -> Result<T, String> {
        let (found, name) = self.text()?;
        read_number(found).ok_or_else(|| format!("{name} is {found:?}, expected a number"))
    }

    fn optional(&mut self) -> Result<Option<f64>, String> {
        let (found, name) = self.text()?;
        if found.is_empty() {
            return Ok(None);
        }
        read_number(found).map(Some).ok_or_else(|| format!("{name} is {found:?}, expected a number or nothing"))
    }

    fn interval(&mut self) -> Result<Option<Interval>, String> {
        let [mean, low, high] = [self.optional()?, self.optional()?, self.optional()?];
        Ok(mean.zip(low).zip(high).map(|((mean, low), high)| Interval { mean, low, high }))
    }
}

/// Reads a number that is written in digits: neither an infinity nor NaN.
fn read_number<T: FromStr>(text: &str) -> Option<T> {
    let has_digits = text.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'-' | b'.'));
    text.parse().ok().filter(|_| has_digits)
}

fn line_of(line: &str, header: &str) -> Result<Row, String> {
    let mut fields = Fields { fields: line.split(','), names: header.split(',') };
    let setting = Setting {
        format: fields.one_of(&Format::ALL, |format| format.name().to_owned())?,
        stride: fields.one_of(&STRIDES, |stride: Stride| stride.get().to_string())?,
        kernel: fields.one_of(&KERNELS, |kernel| kernel_name(kernel).to_owned())?,
        law: fields.one_of(&AnswerLaw::ALL, |law| law.name().to_owned())?,
    };
    let model = Some(fields.text()?.0.to_owned()).filter(|name| name != NONE);
    let found = Found {
        slides: fields.number()?,
        events: fields.number()?,
        accuracy: [fields.interval()?, fields.interval()?, fields.interval()?],
        speed: fields.optional()?.zip(fields.optional()?).map(|(mean, most)| [mean, most]),
        speed_slides: fields.number()?,
        speedless: fields.number()?,
        direction_errors: fields.number()?,
        feature: [fields.number()?, fields.number()?, fields.number()?, fields.number()?],
        latency: fields.optional()?,
        objects: fields.optional()?,
    };
    match fields.fields.count().cmp(&fields.names.count()) {
        Ordering::Less => Err("fewer fields than columns".to_owned()),
        Ordering::Equal => Ok(Row { setting, model, found }),
        Ordering::Greater => Err("more fields than columns".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "YUYV linear,3,libm,published,forest,800,799,81.25,79.00,83.50,90.00,88.00,92.00,,,,3.10,9.00,360,2,7,0.123400,\
        0.002000,0.300000,0.010000,56.5,95.5";

    #[test]
    fn what_is_written_is_read() {
        let text = format!("{FOUND}\n{LINE}\n");
        let rows = read("m", &text).unwrap();
        assert_eq!(rows.len(), 1);
        assert_eq!((rows[0].found.events, rows[0].found.accuracy[2], rows[0].found.speedless), (799, None, 2));
        assert_eq!(write(&rows), text);
    }

    #[test]
    fn the_kept_map_reads_and_is_written_the_same() {
        let rows = kept().unwrap();
        assert_eq!(write(&rows), include_str!("../data/map.csv"));
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (line, parts) in [
            (LINE.replace("YUYV linear", "NV16"), ["line 2: format is \"NV16\"", "GREY"]),
            (LINE.replace(",3,libm", ",4,libm"), ["stride is \"4\"", "1, 2, 3, 5"]),
            (LINE.replace("published", "paper"), ["law is \"paper\"", "wave, coherence, edges, published"]),
            (LINE.replace("81.25", "many"), ["specimen is \"many\"", "a number"]),
            (LINE.replace("81.25", "NaN"), ["specimen is \"NaN\"", "a number"]),
            (LINE.replace(",799,", ",,"), ["events is \"\"", "a number"]),
            (LINE.replace(",56.5", ""), ["objects is missing", "m: "]),
            (format!("{LINE},1"), ["more fields", "line 2"]),
        ] {
            let message = read("m", &format!("{FOUND}\n{line}\n")).unwrap_err().to_string();
            for part in parts {
                assert!(message.contains(part), "{line:?} gave {message:?}, expected {part:?}");
            }
        }
        assert!(read("m", "format\n").unwrap_err().to_string().contains("line 1"));
    }
}
