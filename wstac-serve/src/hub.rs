//! The newest outputs of sensors, kept for the clients. A sensor never waits for a client: it replaces what is older.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use wstac_core::layout::Layout;
use wstac_core::params::{FEATURES, TAXELS};

use crate::order::Order;

/// Frames of the traces, 10 s at 30 per second.
const FRAMES: usize = 300;
/// Events and other records besides features and motion.
const RECORDS: usize = 200;

/// The constant facts of a sensor, as the page gets them.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct About {
    pub(crate) name: Option<String>,
    /// The source and its frames, for a person.
    pub(crate) source: String,
    /// What is assumed because nothing states it, such as the layout: sentences for a person.
    pub(crate) notes: Vec<Cow<'static, str>>,
    /// Width and height of a frame.
    pub(crate) size: [u16; 2],
    /// Width and height of a taxel.
    pub(crate) taxel: [u16; 2],
    /// The top left corners of the taxels, row by row.
    pub(crate) corners: Vec<[u16; 2]>,
    pub(crate) pictures: bool,
    /// Feature frames per second.
    pub(crate) rate: f64,
    /// The folder of recordings, if they are allowed.
    pub(crate) record_to: Option<String>,
    /// The file of a calibration, if it goes to one.
    pub(crate) calibrate_to: Option<String>,
    /// Whether pages can pause it and go back and forth.
    pub(crate) seeks: bool,
}

/// The state of a sensor at its newest frame, as the page gets it.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Status {
    /// The number of the next feature frame.
    pub(crate) frame: u64,
    /// `baseline`, `watching`, `capturing`, `ended` or `failed`.
    pub(crate) phase: &'static str,
    /// Frames of the baseline or of the sample so far, and all of them.
    pub(crate) progress: Option<[u64; 2]>,
    /// The error of a source that has failed.
    pub(crate) error: Option<String>,
    /// The light of each taxel, as a fraction of full scale.
    pub(crate) taxels: Option<[f32; TAXELS]>,
    /// The light above which the trigger fires, as features are written.
    pub(crate) thresholds: Option<[f32; FEATURES]>,
    /// Camera frames that were lost.
    pub(crate) dropped: u64,
    /// Camera frames that were skipped for newer ones.
    pub(crate) camera_skipped: u64,
    /// Milliseconds from the driver's timestamp to reading.
    pub(crate) latency_ms: Option<f64>,
    /// Whether something disturbed the baseline.
    pub(crate) disturbed: bool,
    /// Whether a file or a scene is paused.
    pub(crate) paused: bool,
    /// Whether it starts again at its end.
    pub(crate) loops: bool,
    /// The number of times that it has started again.
    pub(crate) starts: u64,
    /// The number of those that were a way back: what the round has found is found again.
    pub(crate) backs: u64,
}

/// A picture, as the page gets it: width and height, two bytes each, and the square root of the light of each pixel,
/// so that dark pixels keep their differences. The least byte comes first.
pub(crate) type PackedPicture = Arc<[u8]>;

/// The news of a sensor from one step.
#[derive(Debug, Default)]
pub(crate) struct News {
    pub(crate) features: Vec<String>,
    pub(crate) records: Vec<String>,
    pub(crate) motion: Option<String>,
    pub(crate) picture: Option<PackedPicture>,
    /// The state of recordings, calibrations and examinations, if it has changed.
    pub(crate) jobs: Option<String>,
    /// The light that a calibration has seen.
    pub(crate) glow: Option<PackedPicture>,
}

/// The last values of a stream.
#[derive(Debug)]
struct Ring {
    kept: VecDeque<Arc<str>>,
    most: usize,
    /// The number of the next value.
    next: u64,
}

impl Ring {
    fn new(most: usize) -> Self {
        Self { kept: VecDeque::with_capacity(most), most, next: 0 }
    }

    fn extend(&mut self, values: Vec<String>) {
        for value in values {
            if self.kept.len() == self.most {
                self.kept.pop_front();
            }
            self.kept.push_back(value.into());
            self.next += 1;
        }
    }

    /// Forgets the values from number `next` on.
    fn cut(&mut self, next: u64) {
        let kept = self.kept.len().saturating_sub((self.next - next) as usize);
        self.kept.truncate(kept);
        self.next = next;
    }

    /// Returns the values from number `seen` on that are kept, and moves `seen` behind them.
    fn since(&self, seen: &mut u64) -> Vec<Arc<str>> {
        let missed = (self.next - *seen).min(self.kept.len() as u64) as usize;
        *seen = self.next;
        self.kept.range(self.kept.len() - missed..).cloned().collect()
    }
}

/// The last findings of one sensor.
#[derive(Debug)]
struct Channel {
    about: About,
    features: Ring,
    records: Ring,
    /// The number of the first record of this round.
    round: u64,
    motion: Option<Arc<str>>,
    status: Status,
    picture: Option<PackedPicture>,
    /// Steps that brought something.
    steps: u64,
    /// The jobs as the page gets them, and the step that they have changed in.
    jobs: (Arc<str>, u64),
    /// The light that the last calibration has seen, and the step that it has changed in.
    glow: (Option<PackedPicture>, u64),
    /// The order of a page, until the sensor's thread takes it.
    order: Option<Order>,
}

/// The part of a sensor's findings that a client has seen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cursor {
    features: u64,
    records: u64,
    backs: u64,
    steps: u64,
    /// Steps without an update of their own.
    skipped: u64,
}

/// The part of a sensor's findings that a client has not seen.
#[derive(Debug)]
pub(crate) struct Update {
    features: Vec<Arc<str>>,
    records: Vec<Arc<str>>,
    motion: Option<Arc<str>>,
    status: Status,
    /// The jobs, if they have changed.
    jobs: Option<Arc<str>>,
    skipped: u64,
    sensor: usize,
    picture: Option<PackedPicture>,
    /// The light that a calibration has seen, if it has changed.
    glow: Option<PackedPicture>,
}

/// The bit of a sensor's number that says that a picture is the light of a calibration.
const GLOW: u8 = 0x80;

impl Update {
    /// Returns the update as JSON. Its records are the lines of `wstac run --json`.
    pub(crate) fn text(&self) -> Result<String, serde_json::Error> {
        let Self { features, records, motion, status, jobs, skipped, sensor, .. } = self;
        let (features, records) = (features.join(","), records.join(","));
        let (motion, status) = (motion.as_deref().unwrap_or("null"), serde_json::to_string(status)?);
        let jobs = jobs.as_deref().unwrap_or("null");
        Ok(format!(
            r#"{{"update":{sensor},"skipped":{skipped},"status":{status},"motion":{motion},"jobs":{jobs},"features":[{features}],"records":[{records}]}}"#
        ))
    }

    /// Returns the pictures, each behind the number of its sensor: the newest one, and that of a calibration.
    pub(crate) fn pictures(&self) -> impl Iterator<Item = Vec<u8>> {
        let sensor = u8::try_from(self.sensor).ok().filter(|sensor| *sensor < GLOW);
        let of = |picture: &Option<PackedPicture>, bit: u8| {
            let (picture, sensor) = (picture.as_ref()?, sensor?);
            Some([&[sensor | bit], &picture[..]].concat())
        };
        [of(&self.picture, 0), of(&self.glow, GLOW)].into_iter().flatten()
    }
}

/// The last findings of all sensors.
#[derive(Debug)]
pub(crate) struct Hub {
    channels: Mutex<Vec<Channel>>,
    clients: AtomicUsize,
    is_over: AtomicBool,
}

impl Hub {
    pub(crate) fn new(sensors: impl Iterator<Item = About>) -> Self {
        let channel = |about| Channel {
            about,
            features: Ring::new(FRAMES),
            records: Ring::new(RECORDS),
            round: 0,
            motion: None,
            status: Status { phase: "baseline", ..Status::default() },
            picture: None,
            steps: 0,
            jobs: ("null".into(), 0),
            glow: (None, 0),
            order: None,
        };
        let channels = Mutex::new(sensors.map(channel).collect());
        Self { channels, clients: AtomicUsize::new(0), is_over: AtomicBool::new(false) }
    }

    /// Locks the channels, even if a thread that held them panicked. Nobody waits for a client with them.
    fn locked(&self) -> MutexGuard<'_, Vec<Channel>> {
        self.channels.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn publish(&self, sensor: usize, news: News, status: Status) {
        let mut channels = self.locked();
        let Some(channel) = channels.get_mut(sensor) else { return };
        channel.steps += 1;
        channel.features.extend(news.features);
        if channel.status.backs != status.backs {
            channel.records.cut(channel.round);
        }
        channel.records.extend(news.records);
        if channel.status.starts != status.starts {
            channel.features.kept.clear();
            channel.round = channel.records.next;
        }
        channel.motion = news.motion.map(Into::into);
        channel.status = status;
        channel.picture = news.picture.or(channel.picture.take());
        if let Some(jobs) = news.jobs {
            channel.jobs = (jobs.into(), channel.steps);
        }
        if news.glow.is_some() {
            channel.glow = (news.glow, channel.steps);
        }
    }

    /// Returns the facts of all sensors as JSON, the first message of a client.
    pub(crate) fn hello(&self) -> Result<String, serde_json::Error> {
        let about: Vec<About> = self.locked().iter().map(|channel| channel.about.clone()).collect();
        Ok(format!(r#"{{"sensors":{}}}"#, serde_json::to_string(&about)?))
    }

    /// Returns what a client has not seen of a sensor, if there is anything new.
    pub(crate) fn update(&self, sensor: usize, cursor: &mut Cursor) -> Option<Update> {
        let channels = self.locked();
        let channel = channels.get(sensor).filter(|channel| channel.steps != cursor.steps)?;
        let seen = std::mem::replace(&mut cursor.steps, channel.steps);
        // Updates before the client came were not skipped.
        if seen > 0 {
            cursor.skipped += channel.steps - seen - 1;
        }
        // After a way back, a client shows what was kept.
        if std::mem::replace(&mut cursor.backs, channel.status.backs) != channel.status.backs {
            cursor.records = 0;
        }
        Some(Update {
            glow: channel.glow.0.clone().filter(|_| channel.glow.1 > seen),
            jobs: (channel.jobs.1 > seen).then(|| channel.jobs.0.clone()),
            sensor,
            features: channel.features.since(&mut cursor.features),
            records: channel.records.since(&mut cursor.records),
            motion: channel.motion.clone(),
            status: channel.status.clone(),
            skipped: cursor.skipped,
            picture: channel.picture.clone(),
        })
    }

    /// Returns the number of sensors.
    pub(crate) fn sensors(&self) -> usize {
        self.locked().len()
    }

    /// Gives a sensor's thread an order. It is refused if there is no such sensor, or if another one waits.
    pub(crate) fn ask(&self, sensor: usize, order: Order) {
        let mut channels = self.locked();
        match channels.get_mut(sensor) {
            None => order.refuse(sensor, format!("there is no sensor {sensor}")),
            Some(channel) if channel.order.is_some() => order.refuse(sensor, "another order waits: try again"),
            Some(channel) => channel.order = Some(order),
        }
    }

    pub(crate) fn take_order(&self, sensor: usize) -> Option<Order> {
        self.locked().get_mut(sensor)?.order.take()
    }

    /// Takes the layout of a sensor that was calibrated and the notes that remain, for clients to come.
    pub(crate) fn set_layout(&self, sensor: usize, layout: &Layout, notes: Vec<Cow<'static, str>>) {
        if let Some(channel) = self.locked().get_mut(sensor) {
            let about = &mut channel.about;
            (about.taxel, about.corners, about.notes) = (layout.taxel(), layout.corners().to_vec(), notes);
        }
    }

    /// Counts a client until the guard is dropped.
    pub(crate) fn join(&self) -> Joined<'_> {
        self.clients.fetch_add(1, Ordering::Relaxed);
        Joined(self)
    }

    /// Returns whether there are clients, so that pictures are worth their time.
    pub(crate) fn is_watched(&self) -> bool {
        self.clients.load(Ordering::Relaxed) > 0
    }

    pub(crate) fn end(&self) {
        self.is_over.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

/// A client that watches.
pub(crate) struct Joined<'h>(&'h Hub);

impl Drop for Joined<'_> {
    fn drop(&mut self) {
        self.0.clients.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use wstac_core::layout::FrameSize;

    use super::*;
    use crate::order::{Action, Refused};

    fn about() -> About {
        let (source, corners, notes) = (String::new(), Vec::new(), Vec::new());
        let (record_to, calibrate_to) = (None, None);
        let ([size, taxel], [pictures, seeks]) = ([[1, 1]; 2], [false; 2]);
        let (name, rate) = (None, 30.0);
        About { name, source, notes, size, taxel, corners, pictures, rate, record_to, calibrate_to, seeks }
    }

    fn of_features(number: usize) -> News {
        News { features: vec![number.to_string()], ..News::default() }
    }

    fn updates_of(hub: &Hub, cursors: &mut Vec<Cursor>) -> Vec<Update> {
        cursors.resize(hub.sensors(), Cursor::default());
        cursors.iter_mut().enumerate().filter_map(|(sensor, cursor)| hub.update(sensor, cursor)).collect()
    }

    #[test]
    fn clients_get_what_is_new_and_a_count_of_the_rest() {
        let hub = Hub::new([about(), about()].into_iter());
        let (mut fast, mut slow) = (Vec::new(), Vec::new());
        assert!(updates_of(&hub, &mut fast).is_empty());
        for number in 0..FRAMES + 20 {
            hub.publish(1, of_features(number), Status::default());
            let updates = updates_of(&hub, &mut fast);
            assert_eq!((updates.len(), updates[0].sensor, updates[0].skipped), (1, 1, 0));
            assert_eq!(updates[0].features.join(","), number.to_string());
            if number == 0 {
                assert_eq!(updates_of(&hub, &mut slow).len(), 1);
            }
        }
        let late = &updates_of(&hub, &mut slow)[0];
        assert_eq!((late.skipped, late.features.len()), (FRAMES as u64 + 18, FRAMES));
        assert_eq!((&*late.features[0], &*late.features[FRAMES - 1]), ("20", "319"));
        let text = late.text().unwrap();
        assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{text}");
        // A client that comes now has skipped nothing, and gets all that is kept.
        let new = &updates_of(&hub, &mut Vec::new())[0];
        assert_eq!((new.skipped, new.features.len()), (0, FRAMES));
    }

    #[test]
    fn orders_wait_one_at_a_time() {
        let hub = Hub::new([about()].into_iter());
        let (refused, refusals) = channel();
        let ask = |sensor, action| hub.ask(sensor, Order { action, refused: refused.clone() });
        ask(0, Action::Calibrate {});
        ask(0, Action::Stop {});
        ask(7, Action::Stop {});
        let refusals: Vec<_> = refusals.try_iter().map(|Refused { sensor, why }| (sensor, why)).collect();
        assert_eq!(
            refusals,
            [(0, "another order waits: try again".to_owned()), (7, "there is no sensor 7".to_owned())]
        );
        assert_eq!(hub.take_order(0).map(|order| order.action), Some(Action::Calibrate {}));
        assert!(hub.take_order(0).is_none() && hub.take_order(7).is_none());
    }

    #[test]
    fn a_calibrated_sensor_has_the_notes_that_remain() {
        let of_source = || About { notes: vec!["no [layout] is given".into(), "readout unknown".into()], ..about() };
        let hub = Hub::new([of_source(), of_source()].into_iter());
        let layout = Layout::paper(FrameSize::new(640, 480).unwrap()).unwrap();
        hub.set_layout(1, &layout, vec!["readout unknown".into()]);
        let hello: serde_json::Value = serde_json::from_str(&hub.hello().unwrap()).unwrap();
        let sensors = &hello["sensors"];
        assert_eq!(sensors[0]["notes"], serde_json::json!(["no [layout] is given", "readout unknown"]));
        assert_eq!(sensors[1]["notes"], serde_json::json!(["readout unknown"]));
        assert_eq!(sensors[1]["corners"].as_array().map(Vec::len), Some(25));
        // There is no such sensor.
        hub.set_layout(2, &layout, Vec::new());
    }

    #[test]
    fn jobs_are_sent_when_they_have_changed() {
        let hub = Hub::new([about()].into_iter());
        let mut cursors = Vec::new();
        let mut seen = |jobs: Option<&str>| {
            hub.publish(0, News { jobs: jobs.map(str::to_owned), ..News::default() }, Status::default());
            updates_of(&hub, &mut cursors)[0].jobs.clone()
        };
        assert_eq!([seen(None), seen(Some("1")), seen(None)], [None, Some("1".into()), None]);
        assert_eq!(updates_of(&hub, &mut Vec::new())[0].jobs.as_deref(), Some("1"), "a new client gets them");
    }
}
