//! The node: what every board does between its camera and its link. It finds the sensor and sets it up, measures what
//! it sends, turns its frames into messages, and reports and mends every fault.
//!
//! A board gives it a [`Camera`], a [`Bus`], a [`Line`], two lights, a [`Watchdog`], a [`Thermometer`] and a
//! [`SettingsStore`] of settings. Time is embassy's.

use core::array;
use core::future::Future;
use core::mem::{self, MaybeUninit};
use core::pin::pin;

use embassy_futures::select::select;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Delay, Duration, Instant, TICK_HZ, Timer};
use embedded_hal::digital::{OutputPin, PinState};
use embedded_hal::i2c::I2c;
use wstac_core::layout::FrameSize;
use wstac_core::pipeline::NextFrame;
use wstac_core::rate::FrameRate;
use wstac_core::wire::{BusLines, Fault, FrameNumbers, FramePart, Request, Text};

use crate::link::{Line, Link, Told};
use crate::picture::Picture;
use crate::reader::Reader;
use crate::rest::{self, Rest, RestState};
use crate::restart::restart;
use crate::self_test::{self, Probe, RateMeter};
use crate::sensor::watch::Watch;
use crate::sensor::{self, CameraSensor, SensorError, Signals};
use crate::settings_store::SettingsStore;
use crate::stack::StackDepth;
use crate::stripes::{self, Capture, StripeStep, Stripes, Ticks, What};
use crate::{crash_record, setup};

/// The frame rate of the sensors.
pub const RATE: FrameRate = setup::RATE;
/// The frames that a self-test measures, and the longest time for them.
const SELF_TEST_FRAMES: u32 = 4;
const SELF_TEST: Duration = Duration::from_millis(800);
/// The longest time for a frame of luma after the self-test.
const LUMA_TEST: Duration = Duration::from_millis(250);
/// The failures of the bus in a row after which the sensor counts as gone, although frames come.
const BUS_FAILURES: u32 = 30;
/// The microseconds after which the watchdog restarts a program that hangs.
pub const HANGS: u32 = 4_000_000;
/// The cycles for the last two bytes of the line, or for a host to fetch the last packet.
const LAST_BYTES: u32 = 200_000;
/// The time between two attempts to find a sensor.
const TRY_AGAIN: Duration = Duration::from_millis(250);
/// The time after its reset in which every sensor answers.
const WAKES: Duration = Duration::from_millis(50);

/// Returns a board's sensors, none of which keeps the program from its watchdog for [`HANGS`]: it is set up and
/// measured, and again if its clock can be divided.
///
/// # Panics
/// Panics if one does.
#[must_use]
pub const fn in_time(sensors: &[CameraSensor]) -> &[CameraSensor] {
    let mut at = 0;
    while at < sensors.len() {
        let sensor = &sensors[at];
        let (settle, tries) = (sensor.settle_ms as u64, if sensor.slower.is_some() { 2 } else { 1 });
        // The lines of its reset and a free bus take 30 ms.
        let one = 30 + (sensor.reset_ms as u32 + sensor.longest_set_up()) as u64 + settle + SELF_TEST.as_millis();
        let ms = tries * one + LUMA_TEST.as_millis() + settle * !sensor.pattern.is_empty() as u64;
        assert!(ms <= HANGS as u64 / 1000, "a sensor takes longer than the watchdog waits");
        at += 1;
    }
    sensors
}

const LAW: setup::Law = match setup::law(RATE) {
    Ok(law) => law,
    Err(_) => panic!("checked by the build script"),
};
/// The ticks from frame to frame.
const PERIOD: u64 = TICK_HZ * RATE.denominator() as u64 / RATE.numerator() as u64;

/// The signal that a board's interrupts have changed something that the node looks at.
pub static CHANGED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// A camera interface whose whole frames can be measured.
///
/// Its interrupt sums rows while a frame is in use ([`meanwhile`](crate::meanwhile)).
pub trait Camera: Capture + Send {
    /// Takes the sensor's polarities and order of bytes. The next start uses them.
    fn set_signals(&mut self, signals: Signals);

    /// Stops capture until it begins in one way or another.
    fn stop(&mut self);

    /// Begins capture anew, at the next vertical sync. A measurement ends with [`Camera::stop`] or a restart, and the
    /// ring keeps the last bytes.
    fn begin(&mut self, what: What);

    /// Returns the words of a frame's luma.
    fn luma_words(&self) -> u32;

    /// Returns what was measured, until now or until [`Camera::stop`].
    fn probe(&self) -> Probe;

    /// Returns the number of vertical syncs, modulo 2^32, and the ticks at the last one, modulo 2^32.
    fn syncs(&self) -> (u32, u32);

    /// Sleeps until the interface interrupts, which takes fewer instructions than a turn of the executor. Returns false
    /// if another interrupt has come or may have, or if the alarm for this time has: then the executor has to look.
    fn doze(&self, alarm: Ticks) -> bool {
        let _ = alarm;
        false
    }
}

/// The sensor's bus.
pub trait Bus: I2c {
    /// Frees the bus if the sensor holds the data line. Returns whether it did and let go.
    fn free(&mut self) -> bool;

    /// Returns what holds the lines while nothing is sent.
    fn lines(&mut self) -> BusLines;

    /// Switches the sensor off and on again, if the board has lines for that. Returns after the milliseconds in which
    /// it answers then.
    fn restart_sensor(&mut self, wakes_ms: u32) -> impl Future<Output = ()>;
}

/// Restarts a program that hangs for [`HANGS`].
pub trait Watchdog {
    /// Begins that time anew.
    fn pet(&mut self);
}

/// Measures the temperature of the chip.
pub trait Thermometer {
    /// Returns the last temperature in tenths of a degree Celsius, and begins to measure the next one; `None` if there
    /// is none yet.
    fn tenths(&mut self) -> Option<i16>;
}

/// The types of a board's parts.
pub trait Board {
    /// The camera interface.
    type Camera: Camera;
    /// The sensor's bus.
    type Bus: Bus;
    /// The serial line to the host.
    type Line: Line + 'static;
    /// A light, which is lit when it is high.
    type Light: OutputPin + 'static;
    /// The watchdog.
    type Watchdog: Watchdog;
    /// The settings.
    type SettingsStore: SettingsStore + 'static;
    /// The sensor of the chip's temperature.
    type Thermometer: Thermometer;
}

/// A board's parts. Large ones are lent: moved, they would lie on the stack more than once. A row of a frame has
/// `WIDTH` bytes, and a frame `STRIPES` stripes.
pub struct Node<B: Board, const WIDTH: usize, const STRIPES: usize> {
    /// The sensors that the node looks for, in this order. All produce frames of one size.
    pub sensors: &'static [CameraSensor],
    /// The settings.
    pub store: &'static mut B::SettingsStore,
    /// The camera interface.
    pub camera: B::Camera,
    /// The sensor's bus.
    pub bus: B::Bus,
    /// The line to the host, with the light that shows a fault.
    pub line: &'static mut Link<B::Line, B::Light>,
    /// The light that changes with every event.
    pub events: B::Light,
    /// The watchdog.
    pub watchdog: B::Watchdog,
    /// The sensor of the chip's temperature.
    pub thermometer: B::Thermometer,
    /// Whether the watchdog has ended the last run.
    pub hung: bool,
    /// Whether the clock is the chip's own, because that of the board is missing.
    pub is_own_clock: bool,
    /// The unique number of the chip, its lowest word first.
    pub id: Option<[u32; 3]>,
}

/// Answers for ever.
///
/// # Panics
/// Panics if the configuration does not fit the sensors' frames, or at a second call.
pub async fn run<B: Board, const WIDTH: usize, const STRIPES: usize>(mut node: Node<B, WIDTH, STRIPES>) -> ! {
    let (reader, mut is_told) = introduce(&mut node);
    let (sensor, absent) = find(&mut node, reader, &mut is_told).await;
    let mut board = Running::new(node, reader, is_told, sensor, absent);
    // The time for which the executor has an alarm.
    let mut alarm = 0;
    loop {
        board.watchdog.pet();
        board.serve_host();
        if board.stage != Stage::Run {
            board.prepare_sensor().await;
            alarm = 0;
        } else if let Some(until) = board.steps()
            // USB is a task, which gets no turn while this one sleeps.
            && (cfg!(feature = "usb") || !board.stripes.capture().doze(alarm))
        {
            // The executor keeps the earliest of a task's alarms: with a later one, it would not be known when it has
            // none.
            if board.stripes.capture().now() >= alarm {
                alarm = until;
            }
            // They stay where they are made: moved, they would be copied for every stripe.
            select(pin!(CHANGED.wait()), pin!(Timer::at(Instant::from_ticks(alarm)))).await;
        }
    }
}

/// Makes the reader, and tells the host what speaks and why the last run ended. Also returns whether nothing is left to
/// be erased when that was sent.
fn introduce<B: Board, const WIDTH: usize, const STRIPES: usize>(
    node: &mut Node<B, WIDTH, STRIPES>,
) -> (&'static mut Reader, bool) {
    let size = node.sensors.first().map(|sensor| sensor.size);
    let Some(reader) = size.and_then(|size| reader(node.store, size)) else {
        panic!("the configuration does not fit the camera")
    };
    if node.is_own_clock {
        defmt::warn!("no clock from the board: the chip's own is used, and times are within 2 %");
        reader.set_name("wstac-fw on the chip's clock");
    }
    if let Some(id) = node.id {
        reader.set_id(id);
    }
    reader.hello(node.line);
    crash_record::begin(node.hung);
    let (is_told, restarts) = tell_last_run(node.line);
    let telemetry = reader.telemetry_mut();
    (telemetry.restarts, telemetry.overruns) = (Some(restarts), Some(0));
    (reader, is_told)
}

/// The steps before frames are used.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The sensor has to be set up.
    SetUp,
    /// It was set up, and its frames have to be measured.
    Test,
    /// Its frames are used.
    Run,
}

/// A board whose sensor was found.
struct Running<B: Board, const WIDTH: usize, const STRIPES: usize> {
    store: &'static mut B::SettingsStore,
    i2c: B::Bus,
    line: &'static mut Link<B::Line, B::Light>,
    events: B::Light,
    watchdog: B::Watchdog,
    thermometer: B::Thermometer,
    reader: &'static mut Reader,
    stripes: Stripes<B::Camera>,
    picture: Picture<STRIPES>,
    sensor: CameraSensor,
    stage: Stage,
    /// The fault of the camera that the host was told of last.
    absent: Told,
    /// Whether the host knows why the last run ended.
    is_told: bool,
    /// Whether a frame has ended, or none is coming. The time is read only then: that takes 120 instructions.
    is_between: bool,
    depth: StackDepth,
    /// The second in which stack and temperature were measured last.
    second: u64,
    /// The last row of a frame.
    row: [u8; WIDTH],
    watch: Watch,
    meter: RateMeter,
    bus_failures: u32,
    rest: [Rest; rest::BUILDS],
}

impl<B: Board, const WIDTH: usize, const STRIPES: usize> Running<B, WIDTH, STRIPES> {
    fn new(
        node: Node<B, WIDTH, STRIPES>,
        reader: &'static mut Reader,
        is_told: bool,
        sensor: CameraSensor,
        absent: Told,
    ) -> Self {
        let Node { store, camera, bus: i2c, line, events, watchdog, thermometer, .. } = node;
        let mut stripes = Stripes::new(camera, STRIPES as u32, PERIOD);
        let frame_bytes = WIDTH * usize::from(sensor.size.height());
        let picture = Picture::new(stripes.capture().rows(0).len(), frame_bytes);
        stripes.capture_mut().set_signals(sensor.signals);
        reader.state_readout(sensor.readout);
        let (_, _, trigger) = store.parameters();
        Self {
            store,
            i2c,
            line,
            events,
            watchdog,
            thermometer,
            reader,
            stripes,
            picture,
            sensor,
            stage: Stage::Test,
            absent,
            is_told,
            is_between: true,
            depth: StackDepth::new(),
            second: 0,
            row: [0; WIDTH],
            watch: Watch::default(),
            meter: RateMeter::default(),
            bus_failures: 0,
            // It is made only in a build that has it.
            rest: array::from_fn(|_| {
                let can_rest = sensor.resting().is_some() && trigger.backtrack() >= rest::FEWEST_BACKTRACK;
                Rest::new(sensor.settings, if can_rest { rest::DARK } else { u32::MAX })
            }),
        }
    }

    /// Answers requests, and sends what waits. In the middle of a frame, nothing waits unless the line sends.
    fn serve_host(&mut self) {
        let is_between = mem::take(&mut self.is_between);
        if !is_between && self.line.is_idle() {
            return;
        }
        let Self { reader, store, line, .. } = self;
        restart_if_wanted(*store, line);
        let asked = answer_requests(reader, *store, line);
        erase_if_read(&mut self.is_told, line);
        if asked.hello && self.absent != Told::None {
            self.absent = Told::Again;
        }
        if asked.picture {
            self.picture.begin();
        }
        if is_between {
            let now = Instant::now();
            reader.set_time(now.as_micros());
            if self.second != now.as_secs() {
                self.second = now.as_secs();
                let telemetry = reader.telemetry_mut();
                (telemetry.stack, telemetry.temperature) = (Some(self.depth.bytes()), self.thermometer.tenths());
            }
        }
        while line.has_room() && (reader.send_held(*line) || is_between && reader.send_again(*line)) {}
        #[cfg(feature = "learn")]
        if is_between && line.has_room() {
            reader.keep_textures(*store, *line);
        }
        #[cfg(feature = "models")]
        if is_between && line.has_room() {
            reader.keep_model(*store, *line);
        }
    }

    /// Sets the sensor up if that has to be done, and measures its frames. Waits if that fails.
    async fn prepare_sensor(&mut self) {
        if let Some(rest) = self.rest.first_mut() {
            rest.restart();
            self.sensor.settings = rest.awake;
            self.stripes.set_pace(1);
        }
        match bring_up(&mut self.sensor, self.stage, &mut self.i2c, self.stripes.capture_mut()).await {
            Ok(()) => {
                self.stage = Stage::Run;
                (self.watch, self.bus_failures) = (Watch::default(), 0);
                self.reader.telemetry_mut().millihertz = None;
            }
            Err(fault) => {
                self.stage = Stage::SetUp;
                self.line.absence(&mut self.absent, fault);
                self.reader.telemetry_mut().millihertz = Some(0);
                // This also serves a board without a camera.
                self.reader.status(self.line);
                Timer::after(TRY_AGAIN).await;
            }
        }
        self.meter.restart();
        self.stripes.restart();
        self.is_between = true;
    }

    /// Takes steps until a frame has ended or there is nothing to do, and returns the time until which.
    fn steps(&mut self) -> Option<Ticks> {
        loop {
            let until = self.step();
            if until.is_some() || self.is_between {
                return until;
            }
        }
    }

    /// Takes the next rows, or deals with a fault. Returns the time until which there is nothing to do.
    fn step(&mut self) -> Option<Ticks> {
        let Self { reader, line, stripes, .. } = self;
        let stripe = stripes.number() as usize;
        match stripes.step() {
            StripeStep::Rows { rows, last } => {
                let part = if line.has_room_for_picture() { self.picture.part(stripe, rows) } else { None };
                // The last row completes the frame. It is kept back until all rows are known to be those of the camera,
                // and the camera to have its settings.
                let (now, later) = rows.split_at(rows.len() - if last { WIDTH } else { 0 });
                if last {
                    self.row.copy_from_slice(later);
                }
                let mut done = reader.rows(now, *line);
                let is_whole = stripes.release();
                // The part is only sent if it is of rows that were not overwritten.
                if let Some(part) = part.filter(|_| is_whole) {
                    self.picture.send(&part, reader.next_frame(), *line);
                }
                self.is_between = last;
                if is_whole && last && self.is_sensor_right() {
                    let Self { reader, line, stripes, row, .. } = self;
                    let more = |next: &mut NextFrame<'_, _>| {
                        while let Some(rows) = stripes.early_rows() {
                            // Rows that do not fit are reported with the last ones of their frame.
                            let _ = next.push_stripe(rows);
                            if !stripes.release() {
                                break;
                            }
                        }
                    };
                    done = done.and_then(|()| reader.last_rows(row, *line, more));
                }
                if let Err(error) = done {
                    defmt::error!("{}", error);
                }
                if last {
                    let _ = self.events.set_state(PinState::from(self.line.events() % 2 == 1));
                    self.let_rest();
                }
            }
            StripeStep::Abandoned => {
                self.meter.restart();
                reader.abandon_frame(*line);
            }
            StripeStep::Lost(frames) if self.rest.first_mut().is_some_and(Rest::note_gap) => reader.skip(frames, *line),
            StripeStep::Lost(frames) => reader.lost(frames, *line),
            StripeStep::Fault(fault) => self.report(fault),
            StripeStep::Wait(until) => return Some(until),
        }
        None
    }

    /// Returns whether the sensor still has its settings and its rate at the end of a frame. If not, the frame is given
    /// up.
    // It is not inlined, so that faults do not lie on the stack of a function that runs for ever.
    #[inline(never)]
    fn is_sensor_right(&mut self) -> bool {
        let lost = match self.watch.check(&self.sensor, &mut self.i2c) {
            Ok(()) => {
                self.bus_failures = 0;
                if self.rest.first().is_some_and(Rest::is_slow) {
                    self.meter.restart();
                    self.reader.telemetry_mut().millihertz = None;
                    return true;
                }
                wrong_rate(&mut self.meter, self.stripes.capture(), self.reader, &self.sensor)
            }
            Err(SensorError::Bus { .. }) => {
                self.bus_failures += 1;
                free(&mut self.i2c);
                (self.bus_failures >= BUS_FAILURES).then(|| gone(&mut self.i2c))
            }
            Err(error) => Some(error.into()),
        };
        if let Some(fault) = lost {
            self.reader.abandon_frame(self.line);
            self.set_up_again(fault);
        } else if mem::take(&mut self.absent) != Told::None {
            self.line.fault(Fault::SensorBack);
        }
        lost.is_none()
    }

    /// Reports this fault. The sensor is set up before more of its frames are used.
    fn set_up_again(&mut self, fault: Fault<'_>) {
        (self.stage, self.absent) = (Stage::SetUp, Told::Again);
        self.line.absence(&mut self.absent, fault);
    }

    /// Lets the sensor rest after a long time without light, and return at the first light.
    fn let_rest(&mut self) {
        if self.stage != Stage::Run {
            return;
        }
        let Some(rest) = self.rest.first_mut() else { return };
        let settings = match rest.push(self.reader.is_lit()) {
            None => return,
            Some(RestState::Full) => return self.stripes.set_pace(1),
            Some(RestState::Resting) => self.sensor.resting().unwrap_or(rest.awake),
            Some(RestState::Returning) => rest.awake,
            Some(RestState::Overdue) => return self.set_up_again(Fault::LostSync),
        };
        // When it returns, one more frame may come late.
        self.stripes.set_pace(sensor::RESTS.into());
        if !self.sensor.change(settings, &mut self.i2c) {
            // Settings that were written and do not act are read back as right.
            let fault = gone(&mut self.i2c);
            self.set_up_again(fault);
        }
    }

    /// Reports why frames were lost.
    fn report(&mut self, fault: stripes::Fault) {
        self.is_between = true;
        self.meter.restart();
        let fault = match fault {
            stripes::Fault::Overrun => {
                let overruns = &mut self.reader.telemetry_mut().overruns;
                *overruns = overruns.map(|number| number.saturating_add(1));
                Fault::Overrun
            }
            stripes::Fault::LostSync => Fault::LostSync,
            stripes::Fault::Silent => return self.set_up_again(Fault::SensorSilent),
        };
        self.line.fault(fault);
    }
}

/// Sets the sensor up if that has to be done, and measures its frames. If they come at a multiple of the rate, the
/// clock is divided.
async fn bring_up(
    sensor: &mut CameraSensor,
    stage: Stage,
    i2c: &mut impl Bus,
    camera: &mut impl Camera,
) -> Result<(), Fault<'static>> {
    let mut done = try_to_bring_up(sensor, stage, i2c, camera).await;
    if let Err(Fault::SensorDiffers { part: FramePart::Rate, found, .. }) = done
        && let Some(times) = self_test::times_nominal(found.millihertz, RATE)
        && sensor.slow_down(times)
    {
        defmt::warn!("{=u32} times the rate: the clock is divided", times);
        done = try_to_bring_up(sensor, Stage::SetUp, i2c, camera).await;
    }
    if let Err(Fault::SensorGone { .. }) = done {
        done = Err(gone(i2c));
    }
    done
}

async fn try_to_bring_up(
    sensor: &CameraSensor,
    stage: Stage,
    i2c: &mut impl Bus,
    camera: &mut impl Camera,
) -> Result<(), Fault<'static>> {
    camera.stop();
    if stage == Stage::SetUp {
        i2c.restart_sensor(sensor.reset_ms.into()).await;
        free(i2c);
        sensor.set_up(i2c, &mut Delay)?;
    }
    sensor.show_pattern(i2c, true)?;
    Timer::after_millis(sensor.settle_ms.into()).await;
    camera.begin(What::AllBytes);
    measured(camera, SELF_TEST_FRAMES, SELF_TEST).await;
    let probe = camera.probe();
    // The ring keeps the last bytes.
    camera.stop();
    if probe.frames == 0 || probe.lines == 0 {
        return Err(Fault::SensorSilent);
    }
    let Probe { frames, ticks, lines, words } = probe;
    let found = FrameNumbers { lines, words, millihertz: self_test::millihertz(frames, ticks, TICK_HZ) };
    let differs = |part| sensor.differs(part, sensor.frames().words, found);
    let [width, height] = sensor.sent();
    let early = self_test::early_pixels(probe, width, sensor.signals.border);
    let size = [width + early, height];
    let judged =
        [0, 1].map(|half| self_test::judge(probe, camera.rows(half), size, sensor.signals.has_chroma, RATE, TICK_HZ));
    let luma_first = match judged {
        [Err(part), _] | [_, Err(part)] => {
            return Err(differs(part));
        }
        [Ok(Some(first)), _] | [Ok(None), Ok(Some(first))] => first,
        // Luma and chroma look the same, so the table has to be right.
        [Ok(None), Ok(None)] => sensor.signals.luma_first,
    };
    if luma_first != sensor.signals.luma_first {
        defmt::warn!("chroma comes first, which is not as it was set: it is left out all the same");
    }
    camera.set_signals(Signals { luma_first, early, ..sensor.signals });
    camera.begin(What::Luma);
    measured(camera, 1, LUMA_TEST).await;
    let Probe { lines, words, .. } = camera.probe();
    if words != camera.luma_words() {
        return Err(sensor.differs(FramePart::Size, camera.luma_words(), FrameNumbers { lines, words, ..found }));
    }
    if !sensor.pattern.is_empty() {
        camera.stop();
        self_test::judge_pattern([camera.rows(0), camera.rows(1)]).map_err(differs)?;
        sensor.show_pattern(i2c, false)?;
        Timer::after_millis(sensor.settle_ms.into()).await;
    }
    Ok(())
}

/// Waits until so many frames have been measured, or for the longest time.
async fn measured(camera: &impl Camera, frames: u32, longest: Duration) {
    let until = Instant::now() + longest;
    while camera.probe().frames < frames && Instant::now() < until {
        select(CHANGED.wait(), Timer::at(until)).await;
    }
}

/// Returns the fault if the rate of the last frames was wrong, and reports the rate.
fn wrong_rate(
    meter: &mut RateMeter,
    camera: &impl Camera,
    reader: &mut Reader,
    sensor: &CameraSensor,
) -> Option<Fault<'static>> {
    let (syncs, at) = camera.syncs();
    let (frames, ticks) = meter.push(syncs, at)?;
    let millihertz = self_test::millihertz(frames, ticks, TICK_HZ);
    reader.telemetry_mut().millihertz = Some(millihertz);
    let part = self_test::judge_rate(frames, ticks, RATE, TICK_HZ).err()?;
    let expected = sensor.frames();
    Some(sensor.differs(part, expected.words, FrameNumbers { millihertz, ..expected }))
}

/// Creates the core in its place. It is not inlined, so that its parts do not stay on the stack for ever.
#[inline(never)]
#[cfg_attr(
    not(any(feature = "learn", feature = "models")),
    expect(clippy::needless_pass_by_ref_mut, reason = "learned textures and models are read")
)]
fn reader(store: &mut impl SettingsStore, size: FrameSize) -> Option<&'static mut Reader> {
    let reader = cortex_m::singleton!(: MaybeUninit<Reader> = MaybeUninit::uninit())?;
    let (layout, floor, trigger) = store.parameters();
    match Reader::check(layout, size, RATE, LAW, floor, trigger) {
        Ok(build) => {
            let reader = reader.write(build());
            #[cfg(feature = "models")]
            if let Some(place) = cortex_m::singleton!(: Option<setup::Kind> = None)
                && let Some(model) = store.model()
            {
                reader.set_model(place.insert(model));
            }
            #[cfg(feature = "learn")]
            if let Some(names) = cortex_m::singleton!(: crate::learner::Names = crate::learner::no_names()) {
                reader.load_textures(names, store);
            }
            Some(reader)
        }
        Err(error) => {
            defmt::error!("configuration: {}", error);
            None
        }
    }
}

/// The requests of the host to the node itself.
#[derive(Clone, Copy, Default)]
struct Asked {
    /// A description, and so the reason why there are no frames.
    hello: bool,
    picture: bool,
}

// It is not inlined, so that requests do not lie on the stack of a function that runs for ever.
#[inline(never)]
fn answer_requests(
    reader: &mut Reader,
    store: &mut impl SettingsStore,
    line: &mut Link<impl Line, impl OutputPin>,
) -> Asked {
    let mut asked = Asked { hello: line.is_newly_open(), picture: false };
    if asked.hello {
        reader.hello(line);
        tell_last_run(line);
    }
    while let Some(request) = line.request() {
        reader.answer(request, line);
        store.answer(request, line);
        match request {
            Request::Hello => asked.hello = true,
            Request::Picture => asked.picture = true,
            Request::Time { host_us } => line.time(host_us, Instant::now().as_micros()),
            Request::Bootloader => line.leave(),
            _ => {}
        }
    }
    asked
}

/// Starts again if other settings are kept, or the boot loader if that was asked for, and the host has been told.
fn restart_if_wanted(store: &impl SettingsStore, line: &Link<impl Line, impl OutputPin>) {
    let leaving = line.leaving();
    if (store.wants_restart() || leaving.is_some()) && line.is_drained() {
        cortex_m::asm::delay(LAST_BYTES);
        leaving.map_or_else(restart, |enter| enter());
    }
}

/// Reports why the program restarted. Returns whether nothing is left to be erased when that was sent, and the number
/// of restarts.
// It is not inlined, so that the record does not lie on the stack of a function that runs for ever.
#[inline(never)]
fn tell_last_run(line: &mut Link<impl Line, impl OutputPin>) -> (bool, u32) {
    let mut record = crash_record::kept();
    let restarts = record.restarts();
    let is_kept = record.text().is_some();
    if is_kept {
        record.add("; restart ");
        record.add_number(restarts, 10);
        line.fault(Fault::LastRun(Text::new(record.text().unwrap_or_default())));
    }
    (!is_kept, restarts)
}

/// Erases the reason why the program restarted when a host has it.
fn erase_if_read(is_told: &mut bool, line: &Link<impl Line, impl OutputPin>) {
    if !*is_told && line.is_read() {
        *is_told = true;
        crash_record::erase();
    }
}

/// Frees the bus if the sensor holds it.
fn free(i2c: &mut impl Bus) {
    if i2c.free() {
        defmt::warn!("the sensor held its bus");
    }
}

/// Returns the fault of a sensor that does not answer.
#[inline(never)]
fn gone(i2c: &mut impl Bus) -> Fault<'static> {
    Fault::SensorGone { lines: Some(i2c.lines()) }
}

/// Looks for a sensor until one is found, and sets it up. Also returns whether the host was told that there is none.
async fn find<B: Board, const WIDTH: usize, const STRIPES: usize>(
    node: &mut Node<B, WIDTH, STRIPES>,
    reader: &mut Reader,
    is_told: &mut bool,
) -> (CameraSensor, Told) {
    let Node { sensors, store, bus, line, watchdog, .. } = node;
    let mut said = Told::None;
    loop {
        watchdog.pet();
        bus.restart_sensor(0).await;
        Timer::after(WAKES).await;
        free(bus);
        restart_if_wanted(*store, line);
        // A host that has just connected should know, too.
        if answer_requests(reader, *store, line).hello {
            said = Told::None;
        }
        erase_if_read(is_told, line);
        reader.set_time(Instant::now().as_micros());
        #[cfg(feature = "learn")]
        reader.keep_textures(*store, *line);
        #[cfg(feature = "models")]
        reader.keep_model(*store, *line);
        let mut fault = match identify(sensors, store.exposure(), bus) {
            Ok(sensor) => {
                store.limit_exposure(sensor.longest_exposure);
                return (sensor, said);
            }
            Err(fault) => fault,
        };
        if setup::FPS > sensor::WHOLE_FPS
            && let Some(id) = sensor::mt9m114::identity(bus)
        {
            fault = Fault::SensorUnknown { id };
        }
        if let Fault::SensorGone { .. } = fault {
            fault = gone(bus);
        }
        line.absence(&mut said, fault);
        reader.telemetry_mut().millihertz = Some(0);
        reader.status(*line);
        Timer::after(TRY_AGAIN).await;
    }
}

/// Looks for a sensor once, and sets it up with this exposure, or with its longest one.
// It is not inlined, so that sensors and faults do not lie on the stack of a function that runs for ever.
#[inline(never)]
fn identify(
    sensors: &[CameraSensor],
    exposure: Option<u16>,
    i2c: &mut impl Bus,
) -> Result<CameraSensor, Fault<'static>> {
    let mut fault = Fault::SensorGone { lines: None };
    for sensor in sensors {
        let sensor = CameraSensor { lines: exposure.map(|lines| lines.min(sensor.longest_exposure)), ..*sensor };
        match sensor.identify(i2c) {
            Ok(()) => {
                sensor.set_up(i2c, &mut Delay)?;
                defmt::info!("sensor {}", sensor.name);
                return Ok(sensor);
            }
            Err(SensorError::Identity { found: id, .. }) if sensors.iter().all(|known| known.id() != id) => {
                fault = Fault::SensorUnknown { id };
            }
            Err(_) => {}
        }
    }
    Err(fault)
}
