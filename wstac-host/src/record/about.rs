//! The description of a recording: records of metadata, so that it can be read as the source was.

use std::collections::BTreeMap;

use mcap::write::Metadata;
use serde::{Deserialize, Serialize};
use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::rate::FrameRate;

use crate::camera::CameraState;
use crate::config::Config;
use crate::error::{Error, ErrorKind};
use crate::source::{Crop, Labels, ReadoutTime, RowOrder, StreamClock, StreamInfo};

/// The names of the records of metadata.
const STREAM: &str = "wstac.stream";
pub(super) const CONFIGURATION: &str = "wstac.configuration";
const CAMERA: &str = "wstac.camera";
const LABELS: &str = "wstac.labels";
const LAYOUT: &str = "wstac.layout";
/// The name of the record with the names of several sensors.
const SENSORS: &str = "wstac.sensors";
/// The most sensors of a recording: so many have channels below those of other programs.
pub(crate) const MOST_SENSORS: usize = 20;
/// The key of a record that holds a single text.
const JSON: &str = "json";
pub(super) const TOML: &str = "toml";

/// Returns whether a record of this name is a part of a recording's description.
pub(super) fn is_description(name: &str) -> bool {
    // The records of one of several sensors have its name behind a dot.
    let is_of = |own: &&str| name.strip_prefix(*own).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    name == SENSORS || [STREAM, CONFIGURATION, LAYOUT, LABELS, CAMERA].iter().any(is_of)
}

/// Returns the record with the names of several sensors.
///
/// # Errors
/// The names cannot be JSON, which does not happen.
pub(super) fn of_sensors(names: &[&str]) -> Result<Metadata, serde_json::Error> {
    let json = serde_json::to_string(names)?;
    Ok(one(SENSORS.into(), JSON, json))
}

/// Returns the names of the sensors of a recording; none if it is of a single one without a name.
///
/// # Errors
/// The record with the names cannot be read.
pub(crate) fn sensors(all: &[Metadata]) -> Result<Vec<String>, String> {
    let record = all.iter().find(|metadata| metadata.name == SENSORS);
    let Some(json) = record.and_then(|record| record.metadata.get(JSON)) else { return Ok(Vec::new()) };
    let names: Vec<String> = serde_json::from_str(json).map_err(|error| format!("metadata {SENSORS}: {error}"))?;
    if !(1..=MOST_SENSORS).contains(&names.len()) {
        return Err(format!("metadata {SENSORS} has {} names, expected 1 to {MOST_SENSORS}", names.len()));
    }
    Ok(names)
}

/// Returns the name of a sensor's record.
fn of_sensor(name: &str, sensor: Option<&str>) -> String {
    sensor.map_or_else(|| name.to_owned(), |sensor| format!("{name}.{sensor}"))
}

/// The stream, as its frames are stored.
#[derive(Debug, Serialize, Deserialize)]
struct Stream {
    wstac: String,
    size: FrameSize,
    format: PixelFormat,
    /// Recordings keep this name.
    #[serde(rename = "colour")]
    color: YcbcrEncoding,
    bytes_per_row: u32,
    rate: FrameRate,
    /// Whether times and numbers of frames are the driver's own.
    driver_times: bool,
    about: String,
    models: Vec<String>,
    /// The part of the frames that is stored. `size` and `bytes_per_row` are those of whole frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    crop: Option<Crop>,
    /// Whether it has taxel sums in place of pictures.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    taxels_only: bool,
    /// The readout that was in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    readout_ms: Option<f32>,
    #[serde(default, skip_serializing_if = "is_down")]
    row_order: RowOrder,
}

/// The description of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The properties that its frames have in common.
    pub info: StreamInfo,
    /// Whether times and numbers of frames are the driver's own; otherwise they were counted.
    pub driver_times: bool,
    /// The configuration in full, as TOML.
    pub configuration: String,
    /// The labels that a person gave.
    pub labels: Labels,
    /// The texture models that named its events.
    pub models: Vec<String>,
}

impl About {
    /// Creates the description of a new recording.
    ///
    /// If the stream has taxel sums alone, so has the recording. A stream of frames becomes such a recording if
    /// `taxels_only` is set in a copy of its information. If `crop` is set there, only that part of its frames is
    /// stored.
    ///
    /// # Errors
    /// The configuration cannot be written as TOML.
    pub fn new(info: &StreamInfo, config: &Config, labels: Labels, models: Vec<String>) -> Result<Self, Error> {
        let driver_times = info.clock == StreamClock::Driver;
        let configuration =
            config.to_toml().map_err(|error| Error::with_cause(ErrorKind::Config, "configuration", error))?;
        let readout = config.readout(info);
        Ok(Self { info: StreamInfo { readout, ..info.clone() }, driver_times, configuration, labels, models })
    }

    /// Returns the description as records of an MCAP file.
    ///
    /// `layout` is for people and other programs; the configuration has it, too. It is written in pixels of the
    /// pictures that are stored. `sensor` is the name of one of several sensors.
    pub(super) fn to_metadata(&self, layout: &Layout, sensor: Option<&str>) -> serde_json::Result<Vec<Metadata>> {
        let of_pictures = self.info.crop.as_ref().and_then(|crop| crop.layout(layout));
        let layout = of_pictures.as_ref().unwrap_or(layout);
        let Self { info, driver_times, configuration, labels, models } = self;
        let stream = Stream {
            wstac: env!("CARGO_PKG_VERSION").into(),
            size: info.size,
            format: info.format,
            color: info.color,
            bytes_per_row: info.bytes_per_row,
            rate: info.rate,
            driver_times: *driver_times,
            about: info.about.clone(),
            models: models.clone(),
            crop: info.crop,
            taxels_only: info.taxels_only,
            readout_ms: info.readout.map(ReadoutTime::ms),
            row_order: info.row_order,
        };
        let one = |name: &str, key: &str, text: String| one(of_sensor(name, sensor), key, text);
        let mut all = vec![
            one(STREAM, JSON, serde_json::to_string(&stream)?),
            one(CONFIGURATION, TOML, configuration.clone()),
            one(LAYOUT, JSON, serde_json::to_string(layout)?),
            Metadata { name: of_sensor(LABELS, sensor), metadata: labels.clone() },
        ];
        if let Some(camera) = &info.camera {
            all.push(one(CAMERA, JSON, serde_json::to_string(camera)?));
        }
        Ok(all)
    }

    /// Reads the description from the records of an MCAP file; `None` if this program did not record the file, or not
    /// of this sensor.
    ///
    /// # Errors
    /// A record cannot be read. The error says which, what was found and what was expected.
    pub(crate) fn from_metadata(all: &[Metadata], sensor: Option<&str>) -> Result<Option<Self>, String> {
        // The first of a name counts: records that other programs add come later.
        let of = |name: &str| {
            let name = of_sensor(name, sensor);
            all.iter().find(|metadata| metadata.name == name).map(|metadata| &metadata.metadata)
        };
        let text = |name: &str, key: &str| of(name).and_then(|metadata| metadata.get(key));
        let Some(stream) = text(STREAM, JSON) else { return Ok(None) };
        let in_record = |name: &'static str| move |error: serde_json::Error| format!("metadata {name}: {error}");
        let stream: Stream = serde_json::from_str(stream).map_err(in_record(STREAM))?;
        let camera: Option<CameraState> =
            text(CAMERA, JSON).map(|camera| serde_json::from_str(camera)).transpose().map_err(in_record(CAMERA))?;
        if stream.crop.is_some_and(|crop| !crop.fits(stream.size)) {
            return Err(format!("metadata {STREAM}: crop is no part of a frame of its size"));
        }
        let info = StreamInfo {
            clock: if stream.driver_times { StreamClock::Driver } else { StreamClock::Frames },
            crop: stream.crop,
            taxels_only: stream.taxels_only,
            readout: stream.readout_ms.and_then(ReadoutTime::from_ms),
            row_order: stream.row_order,
            color: stream.color,
            bytes_per_row: stream.bytes_per_row,
            camera: camera.map(Box::new),
            ..StreamInfo::new(stream.about, stream.size, stream.format, stream.rate)
        };
        Ok(Some(Self {
            info,
            driver_times: stream.driver_times,
            configuration: text(CONFIGURATION, TOML).cloned().unwrap_or_default(),
            labels: of(LABELS).cloned().unwrap_or_default(),
            models: stream.models,
        }))
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives fields by reference")]
fn is_down(order: &RowOrder) -> bool {
    *order == RowOrder::Down
}

/// Returns a record that holds a single text.
fn one(name: String, key: &str, text: String) -> Metadata {
    Metadata { name, metadata: BTreeMap::from([(key.into(), text)]) }
}

#[cfg(test)]
mod tests {
    use wstac_core::green::ycbcr::YcbcrMatrix;

    use super::*;

    /// The description as the first version wrote it. Recordings stay readable.
    const OF_BEFORE: &str = concat!(
        r#"{"wstac":"0.1.0","size":[40,40],"format":"Grey","colour":{"matrix":"Bt709","range":"Limited"},"#,
        r#""bytes_per_row":40,"rate":[30,1],"driver_times":false,"about":"a scene","models":[]}"#
    );

    #[test]
    fn recordings_of_before_are_read_and_written_alike() {
        let stream = Metadata { name: STREAM.into(), metadata: BTreeMap::from([(JSON.into(), OF_BEFORE.into())]) };
        let about = About::from_metadata(&[stream], None).unwrap().unwrap();
        assert_eq!((about.info.format, about.info.color.matrix), (PixelFormat::Gray, YcbcrMatrix::Bt709));
        let layout = Layout::paper(about.info.size).unwrap();
        let written = about.to_metadata(&layout, None).unwrap();
        assert_eq!(About::from_metadata(&written, None).unwrap().unwrap(), about);
        // Only the version is that of this program.
        let of_now = OF_BEFORE.replacen("0.1.0", env!("CARGO_PKG_VERSION"), 1);
        assert_eq!(written[0].metadata[JSON], of_now);
    }
}
