//! The firmware of a Nucleo-H743ZI2 with a parallel camera: frames in stripes by DMA, events out of the serial line.
//! The wiring is in `README.md`.
#![no_std]
#![no_main]
#![allow(clippy::used_underscore_binding, reason = "by the macro around main alone")]

use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_futures::select::select;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, Pull, Speed};
use embassy_stm32::i2c::{self, I2c, Master};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::{DBGMCU, RCC};
use embassy_stm32::rcc::{
    APBPrescaler, HSIPrescaler, Hse, HseMode, Mco, Mco1Source, McoConfig, Pll, PllDiv, PllMul, PllPreDiv, PllSource,
    Sysclk, VoltageScale,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, Peri, bind_interrupts, peripherals};
use embassy_time::{Delay, Duration, Instant, TICK_HZ, Timer};
use wstac_core::layout::Layout;
use wstac_core::rate::FrameRate;
use wstac_core::wire::{Fault, Request, Text};
use wstac_fw::keeper::Keeper;
use wstac_fw::link::{Absence, Link};
use wstac_fw::picture::Picture;
use wstac_fw::reader::Reader;
use wstac_fw::self_test::{self, Defect, Probe, RateMeter};
use wstac_fw::sensor::ov7690::OV7690;
use wstac_fw::sensor::ov7692::OV7692;
use wstac_fw::sensor::ov7725::OV7725;
use wstac_fw::sensor::watch::Watch;
use wstac_fw::sensor::{Sensor, SensorError};
use wstac_fw::serial::{self, Serial};
use wstac_fw::stripes::dcmi::{CHANGED, Dcmi, DcmiInterrupts, Ring};
use wstac_fw::stripes::{self, Capture, Step, Stripes};
use wstac_fw::{bus, crash_record, setup};

/// The sensors that the firmware looks for, in this order. All produce frames of one size.
const SENSORS: [Sensor; 3] = [OV7690, OV7692, OV7725];
/// The frame rate of the sensors.
const RATE: FrameRate = FrameRate::NOMINAL;
/// The rows of a stripe.
const ROWS: u16 = 10;
/// The bits per second of the serial line.
const BAUD: u32 = 115_200;
/// The frames that a self-test measures, and the longest time for them.
const SELF_TEST_FRAMES: u32 = 4;
const SELF_TEST: Duration = Duration::from_millis(800);
/// The longest time for a frame of luma after that.
const LUMA_TEST: Duration = Duration::from_millis(250);
/// The failures of the bus in a row after which the sensor counts as gone, although frames come.
const BUS_FAILURES: u32 = 30;
/// The microseconds after which the watchdog restarts a program that hangs. The longest self-test, with a second try,
/// takes three seconds.
const HANGS: u32 = 4_000_000;
/// The cycles between two looks at the debugger's clock, and their number: a quarter of a second at 64 MHz.
const HSE_CYCLES: u32 = 6400;
const HSE_LOOKS: u32 = 2500;
/// The time between two attempts to find a sensor.
const TRY_AGAIN: Duration = Duration::from_millis(250);

/// The layout that is compiled in.
const LAYOUT: Layout = match setup::layout(SENSORS[0].size) {
    Ok(layout) => layout,
    Err(_) => panic!("the configuration's [layout] does not fit frames of 320 x 240"),
};
const LAW: setup::Law = match setup::law(RATE) {
    Ok(law) => law,
    Err(_) => panic!("checked by the build script"),
};
/// The bytes of a row.
const WIDTH: usize = SENSORS[0].size.width() as usize;
/// The stripes of a frame.
const STRIPES: usize = (SENSORS[0].size.height() / ROWS) as usize;
/// The words of a stripe.
const WORDS: usize = WIDTH * ROWS as usize / 4;
/// The ticks from frame to frame.
const PERIOD: u64 = TICK_HZ * RATE.denominator() as u64 / RATE.numerator() as u64;

bind_interrupts!(struct Irqs {
    DCMI => DcmiInterrupts;
    DMA1_STREAM0 => DcmiInterrupts;
    USART3 => serial::SerialInterrupts;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let has_hse = has_hse();
    let p = embassy_stm32::init(clocks(has_hse));
    // It waits while a debugger halts the core.
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
    let mut watchdog = IndependentWatchdog::new(p.IWDG1, HANGS);
    watchdog.unleash();
    let hung = RCC.rsr().read().iwdg1rstf();
    RCC.rsr().modify(|w| w.set_rmvf(true));
    // The sensor's clock: 24 MHz.
    let _clock = Mco::new(p.MCO1, p.PA8, Mco1Source::PLL1_Q, McoConfig::default());
    let mut events = Output::new(p.PB0, Level::Low, Speed::Low);
    let serial = Serial::new(p.USART3, Irqs, p.PD8, p.PD9, BAUD);
    let mut line = Link::new(serial, Output::new(p.PB14, Level::Low, Speed::Low));
    let mut keeper = Keeper::new(p.FLASH, LAYOUT, RATE);
    let Some(reader) = reader(&keeper) else { panic!("the configuration does not fit the camera") };
    if !has_hse {
        defmt::warn!("no clock of 8 MHz: the chip's own is used, and times are within 2 %");
        reader.set_name("wstac-fw on the chip's clock");
    }
    reader.hello(&mut line);
    let mut is_told = tell_last_run(hung, &mut line);

    let pins: [Peri<'static, AnyPin>; 11] = [
        p.PC6.into(),
        p.PC7.into(),
        p.PC8.into(),
        p.PC9.into(),
        p.PE4.into(),
        p.PD3.into(),
        p.PE5.into(),
        p.PE6.into(),
        p.PB7.into(),
        p.PA4.into(),
        p.PA6.into(),
    ];
    for pin in pins {
        let mut pin = Flex::new(pin);
        pin.set_as_af_unchecked(DCMI_PINS, AfType::input(Pull::Down));
        // A dropped pin would be disconnected.
        core::mem::forget(pin);
    }
    let mut config = i2c::Config::default();
    // Three transfers are made between two stripes.
    config.timeout = Duration::from_micros(600);
    let mut i2c = I2c::new_blocking(p.I2C1, p.PB8, p.PB9, config);
    let mut sensor = find(&mut i2c, reader, &mut keeper, &mut line, &mut watchdog).await;

    let Some(ring) = cortex_m::singleton!(: Ring<WORDS> = [[0; WORDS]; 2]) else { panic!("the ring is taken once") };
    let Some(dcmi) = Dcmi::new(p.DCMI, p.DMA1_CH0, Irqs, ring, sensor.size, ROWS, sensor.signals) else {
        panic!("the ring does not fit the frames, or is more than the DMA counts");
    };
    let mut stripes = Stripes::new(dcmi, STRIPES as u32, PERIOD);
    let mut picture = Picture::<STRIPES>::new(4 * WORDS);
    let mut stage = Stage::Test;
    let mut absent = Absence::None;
    let (mut watch, mut meter, mut bus_failures) = (Watch::default(), RateMeter::default(), 0);
    loop {
        watchdog.pet();
        if !is_told && line.is_drained() {
            is_told = true;
            crash_record::erase();
        }
        keeper.restart_if_wanted(&line);
        while let Some(request) = line.request() {
            reader.answer(request, &mut line);
            keeper.answer(request, &mut line);
            match request {
                Request::Hello => line.absence(absent),
                Request::Picture => picture.begin(),
                _ => {}
            }
        }
        while line.has_room() && reader.send_held(&mut line) {}
        if stage != Stage::Run {
            match bring_up(&mut sensor, stage, &mut i2c, stripes.capture_mut()).await {
                Ok(()) => {
                    stage = Stage::Run;
                    (watch, bus_failures) = (Watch::default(), 0);
                }
                Err(Failure { reason, defect }) => {
                    stage = Stage::SetUp;
                    if absent != reason {
                        absent = reason;
                        log(defect);
                        line.absence(reason);
                    }
                    // This also serves a board without a camera.
                    reader.status(&mut line);
                    Timer::after(TRY_AGAIN).await;
                }
            }
            meter.restart();
            stripes.restart();
            continue;
        }
        let stripe = stripes.number() as usize;
        match stripes.step() {
            Step::Rows { rows, last } => {
                let part = if line.has_room_for_picture() { picture.part(stripe, rows) } else { None };
                // The last row completes the frame. It is kept back until all rows are known to be those of the camera,
                // and the camera to have its settings.
                let (now, later) = rows.split_at(rows.len() - if last { WIDTH } else { 0 });
                let mut row = [0; WIDTH];
                row[..later.len()].copy_from_slice(later);
                let mut done = reader.rows(now, &mut line);
                let is_whole = stripes.release();
                // The part is only sent if it is of rows that were not overwritten.
                if let Some(part) = part.filter(|_| is_whole) {
                    picture.send(&part, reader.next_frame(), &mut line);
                }
                if is_whole && last {
                    let lost = match watch.check(&sensor, &mut i2c) {
                        Ok(()) => {
                            bus_failures = 0;
                            wrong_rate(&mut meter, stripes.capture()).map(|defect| {
                                log(Some(defect));
                                Absence::of(defect, &sensor)
                            })
                        }
                        Err(SensorError::Bus { .. }) => {
                            bus_failures += 1;
                            if bus::free() {
                                defmt::warn!("the sensor held its bus");
                            }
                            (bus_failures >= BUS_FAILURES).then_some(Absence::Gone)
                        }
                        Err(error) => Some(error.into()),
                    };
                    if let Some(reason) = lost {
                        reader.abandon_frame(&mut line);
                        (stage, absent) = (Stage::SetUp, reason);
                        line.absence(reason);
                    } else {
                        if absent != Absence::None {
                            absent = Absence::None;
                            line.fault(Fault::SensorBack);
                        }
                        done = done.and_then(|()| reader.rows(&row, &mut line));
                    }
                }
                if let Err(error) = done {
                    defmt::error!("{}", error);
                }
                events.set_level(Level::from(line.events() % 2 == 1));
            }
            Step::Abandoned => {
                meter.restart();
                reader.abandon_frame(&mut line);
            }
            Step::Lost(frames) => reader.lost(frames, &mut line),
            Step::Fault(fault) => {
                meter.restart();
                match fault {
                    stripes::Fault::Overrun => line.fault(Fault::Overrun),
                    stripes::Fault::LostSync => line.fault(Fault::LostSync),
                    stripes::Fault::Silent => {
                        (stage, absent) = (Stage::SetUp, Absence::Silent);
                        line.fault(Fault::SensorSilent);
                    }
                }
            }
            Step::Wait(until) => {
                select(CHANGED.wait(), Timer::at(Instant::from_ticks(until))).await;
            }
        }
    }
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

/// The reason why there are no frames, and the measurement that shows it.
struct Failure {
    reason: Absence,
    defect: Option<Defect>,
}

/// Sets the sensor up if that has to be done, and measures its frames. If they come at a multiple of the rate, the clock
/// is divided.
async fn bring_up(
    sensor: &mut Sensor,
    stage: Stage,
    i2c: &mut I2c<'_, Blocking, Master>,
    dcmi: &mut Dcmi,
) -> Result<(), Failure> {
    let done = try_to_bring_up(sensor, stage, i2c, dcmi).await;
    if let Err(Failure { defect: Some(Defect::Rate { millihertz }), .. }) = done
        && let Some(times) = self_test::times_nominal(millihertz, RATE)
        && sensor.slow_down(times)
    {
        defmt::warn!("{=u32} times the rate: the clock is divided", times);
        return try_to_bring_up(sensor, Stage::SetUp, i2c, dcmi).await;
    }
    done
}

async fn try_to_bring_up(
    sensor: &Sensor,
    stage: Stage,
    i2c: &mut I2c<'_, Blocking, Master>,
    dcmi: &mut Dcmi,
) -> Result<(), Failure> {
    dcmi.stop();
    if stage == Stage::SetUp {
        if bus::free() {
            defmt::warn!("the sensor held its bus");
        }
        sensor.set_up(i2c, &mut Delay).map_err(|error| Failure { reason: error.into(), defect: None })?;
    }
    Timer::after_millis(sensor.settle_ms.into()).await;
    dcmi.begin_probe();
    measured(dcmi, SELF_TEST_FRAMES, SELF_TEST).await;
    let probe = dcmi.probe();
    // The ring keeps the last bytes.
    dcmi.stop();
    let judged = [0, 1].map(|half| self_test::judge(probe, dcmi.rows(half), sensor.size, RATE, TICK_HZ));
    let luma_first = match judged {
        [Err(defect), _] | [_, Err(defect)] => {
            return Err(Failure { reason: Absence::of(defect, sensor), defect: Some(defect) });
        }
        [Ok(Some(first)), _] | [Ok(None), Ok(Some(first))] => first,
        // Luma and chroma look the same, so the table has to be right.
        [Ok(None), Ok(None)] => sensor.signals.luma_first,
    };
    if luma_first != sensor.signals.luma_first {
        defmt::warn!("chroma comes first, which is not as it was set: it is left out all the same");
    }
    dcmi.set_luma_first(luma_first);
    dcmi.begin_luma_probe();
    measured(dcmi, 1, LUMA_TEST).await;
    let Probe { lines, words, .. } = dcmi.probe();
    if words == dcmi.luma_words() {
        return Ok(());
    }
    let defect = Defect::Size { lines, words };
    Err(Failure { reason: Absence::of(defect, sensor), defect: Some(defect) })
}

/// Waits until so many frames have been measured, or for the longest time.
async fn measured(dcmi: &Dcmi, frames: u32, longest: Duration) {
    let until = Instant::now() + longest;
    while dcmi.probe().frames < frames && Instant::now() < until {
        select(CHANGED.wait(), Timer::at(until)).await;
    }
}

/// Returns the defect if the rate of the last frames was wrong.
fn wrong_rate(meter: &mut RateMeter, dcmi: &Dcmi) -> Option<Defect> {
    let (syncs, at) = dcmi.syncs();
    let (frames, ticks) = meter.push(syncs, at)?;
    self_test::judge_rate(frames, ticks, RATE, TICK_HZ).err()
}

/// Logs the measurement that shows a defect. The host is told the register that has to do with it.
fn log(defect: Option<Defect>) {
    match defect {
        None | Some(Defect::NoFrames) => {}
        Some(Defect::Size { lines, words }) => defmt::error!("frames have {=u32} lines and {=u32} words", lines, words),
        Some(Defect::Format) => defmt::error!("bytes are not luma and fixed chroma in turn"),
        Some(Defect::Rate { millihertz }) => defmt::error!("{=u32} frames in 1000 seconds", millihertz),
    }
}

/// Creates the core in its place. It is not inlined, so that its parts do not stay on the stack for ever.
#[inline(never)]
fn reader(keeper: &Keeper) -> Option<&'static mut Reader> {
    let reader = cortex_m::singleton!(: Option<Reader> = None)?;
    let (layout, floor, trigger) = keeper.parameters();
    match Reader::with(layout, SENSORS[0].size, RATE, LAW, floor, trigger) {
        Ok(new) => Some(reader.insert(new)),
        Err(error) => {
            defmt::error!("configuration: {}", error);
            None
        }
    }
}

/// The number of the camera interface's function of its pins.
const DCMI_PINS: u8 = 13;

/// Switches the debugger's clock of 8 MHz on and returns whether it runs.
fn has_hse() -> bool {
    RCC.cr().modify(|w| w.set_hsebyp(true));
    RCC.cr().modify(|w| w.set_hseon(true));
    (0..HSE_LOOKS).any(|_| {
        cortex_m::asm::delay(HSE_CYCLES);
        RCC.cr().read().hserdy()
    })
}

/// Reports why the program restarted. Returns whether nothing is left to be erased when that was sent.
fn tell_last_run(hung: bool, line: &mut Link) -> bool {
    let mut record = crash_record::begin();
    let is_kept = record.text().is_some();
    if hung && !is_kept {
        record.add("the program hung, and the watchdog ended it");
    }
    if record.text().is_some() {
        let restarts = record.restarts();
        record.add("; restart ");
        record.add_number(restarts, 10);
        line.fault(Fault::LastRun(Text::new(record.text().unwrap_or_default())));
    }
    !is_kept
}

/// Returns the clock configuration: 96 MHz from the debugger's 8 MHz or the chip's 64 MHz, and 24 MHz for the sensor.
///
/// The supply range is VOS3, the lowest to run in.
///
/// The camera interface needs 2.5 times the pixel clock of 24 MHz, which is 60 MHz. The PLL's range for a reference of
/// more than 2 MHz begins at 192 MHz; 576 MHz gives 96 MHz and 24 MHz.
fn clocks(has_hse: bool) -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hsi48 = None;
    let (source, prediv) = if has_hse {
        rcc.hsi = None;
        rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
        (PllSource::HSE, PllPreDiv::DIV1)
    } else {
        rcc.hsi = Some(HSIPrescaler::DIV1);
        (PllSource::HSI, PllPreDiv::DIV8)
    };
    rcc.pll1 = Some(Pll {
        source,
        prediv,
        mul: PllMul::MUL72,
        fracn: None,
        divp: Some(PllDiv::DIV6),
        divq: Some(PllDiv::DIV24),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale3;
    config
}

/// Looks for a sensor until one is found, and sets it up.
async fn find(
    i2c: &mut I2c<'_, Blocking, Master>,
    reader: &mut Reader,
    keeper: &mut Keeper,
    line: &mut Link,
    watchdog: &mut IndependentWatchdog<'_, peripherals::IWDG1>,
) -> Sensor {
    let mut said = Absence::None;
    loop {
        watchdog.pet();
        if bus::free() {
            defmt::warn!("the sensor held its bus");
        }
        keeper.restart_if_wanted(line);
        while let Some(request) = line.request() {
            reader.answer(request, line);
            keeper.answer(request, line);
            // A host that has just connected should know, too.
            said = if request == Request::Hello { Absence::None } else { said };
        }
        let mut reason = Absence::Gone;
        for sensor in &SENSORS {
            let sensor = Sensor { lines: keeper.exposure(), ..*sensor };
            match sensor.identify(i2c) {
                Ok(()) => match sensor.set_up(i2c, &mut Delay) {
                    Ok(()) => {
                        defmt::info!("sensor {}", sensor.name);
                        return sensor;
                    }
                    Err(error) => {
                        reason = error.into();
                        break;
                    }
                },
                Err(SensorError::Identity { found: id, .. }) if SENSORS.iter().all(|known| known.id() != id) => {
                    reason = Absence::Unknown { id };
                }
                Err(_) => {}
            }
        }
        if said != reason {
            said = reason;
            line.absence(reason);
        }
        reader.status(line);
        Timer::after(TRY_AGAIN).await;
    }
}
