//! RP2040 and RP2350: what the Raspberry Pi Pico and Pico 2 share, and every board with one of these chips.

mod bus;
#[cfg(feature = "settings")]
mod flash;
mod thermometer;
mod uart;
#[cfg(feature = "usb")]
mod usb;

pub use bus::RpBus;
pub use thermometer::RpThermometer;
pub use uart::{UartInterrupts, uart0};
#[cfg(feature = "usb")]
pub use usb::usb;

use embassy_rp::clocks::{ClockConfig, Gpout, GpoutPin, GpoutSrc, SysClkConfig, SysClkSrc};
use embassy_rp::config::Config;
use embassy_rp::gpio::Output;
#[cfg(feature = "rp2040")]
use embassy_rp::pac::CLOCKS;
use embassy_rp::watchdog::{ResetReason, Watchdog as ChipWatchdog};
use embassy_rp::{Peri, Peripherals, bind_interrupts, peripherals};
use embassy_time::Duration;
use wstac_core::layout::{FrameSize, Layout};

#[cfg(feature = "settings")]
use self::flash::{RpFlash, SECTORS};
use crate::link::Link;
use crate::node::{self, Board, HANGS, Node, Watchdog};
use crate::sensor::hm01b0::{DataWires, hm01b0};
#[cfg(feature = "settings")]
use crate::sensor::longest_exposure;
use crate::sensor::{CameraSensor, WHOLE_FPS};
use crate::serial::Serial;
#[cfg(not(feature = "settings"))]
use crate::settings_store::FixedSettings;
#[cfg(feature = "settings")]
use crate::settings_store::KeptSettings;
use crate::setup;
use crate::stripes::pio::{Area, Blocks, Pio, PioInterrupts, Wires};

/// The clock of the core. The sensor's is a whole part of it.
const CLOCK: u32 = 1_000_000 * setup::MHZ;
/// The fewest clocks of a PIO for a pixel clock: its machine takes four for a bit.
const PIO_CLOCKS: u32 = 5;
/// The clock of USB, and of the PLL that makes it.
const USB_CLOCK: u32 = 48_000_000;
const SENSOR_CLOCK: u32 = 24_000_000;
/// The rows of a stripe, which divide those of a frame.
const ROWS: u16 = 22;
/// The sensors with each number of data wires.
static WITH_1: &[CameraSensor] = node::in_time(&[hm01b0(DataWires::One)]);
static WITH_4: &[CameraSensor] = node::in_time(&[hm01b0(DataWires::Four)]);
static WITH_8: &[CameraSensor] = node::in_time(&[hm01b0(DataWires::Eight)]);
/// The size of what is used of their frames.
const SIZE: FrameSize = hm01b0(DataWires::Eight).size;
const BORDER: u16 = hm01b0(DataWires::Eight).signals.border;

/// The rows that are captured. Those below the picture are no part of it, but a line that is lost is then missed at the
/// next sync.
const HEIGHT: u16 = SIZE.height() + BORDER;
const LAYOUT: Layout = match setup::layout(SIZE) {
    Ok(layout) => match FrameSize::new(SIZE.width() as u32, HEIGHT as u32) {
        Ok(size) => match Layout::new(size, layout.taxel(), *layout.corners()) {
            Ok(layout) => layout,
            Err(_) => panic!("taxels of 320 x 240 are inside 320 x 242"),
        },
        Err(_) => panic!("320 x 242 is a size of frames"),
    },
    Err(_) => panic!("the configuration's [layout] does not fit frames of 320 x 240"),
};
/// The bytes of a row.
const WIDTH: usize = SIZE.width() as usize;
/// The stripes of a frame.
const STRIPES: usize = (HEIGHT / ROWS) as usize;

bind_interrupts!(
    /// The interrupts of the PIO, its DMA and the serial line.
    pub struct RpIrqs {
        PIO0_IRQ_0 => PioInterrupts;
        DMA_IRQ_1 => PioInterrupts;
        UART0_IRQ => UartInterrupts;
    }
);

/// The parts of an RP2040 or RP2350.
pub struct Rp;

impl Board for Rp {
    type Camera = Pio;
    type Bus = RpBus;
    type Line = Serial;
    type Light = RpLight;
    type Watchdog = Dog;
    #[cfg(feature = "settings")]
    type SettingsStore = KeptSettings<RpFlash>;
    #[cfg(not(feature = "settings"))]
    type SettingsStore = FixedSettings;
    type Thermometer = RpThermometer;
}

/// The watchdog, with the time after which it restarts the chip.
pub struct Dog(ChipWatchdog);

impl Watchdog for Dog {
    fn pet(&mut self) {
        self.0.feed(Duration::from_micros(HANGS.into()));
    }
}

/// A board's pins, and the peripherals behind them.
pub struct RpWiring {
    /// The camera's wires.
    pub camera: Wires,
    /// The PIO.
    pub pio: Peri<'static, peripherals::PIO0>,
    /// The channels of the DMA.
    pub channels: (Peri<'static, peripherals::DMA_CH0>, Peri<'static, peripherals::DMA_CH1>),
    /// The sensor's bus.
    pub bus: RpBus,
    /// The line to the host.
    pub line: Serial,
    /// The light that changes with every event.
    pub events: RpLight,
    /// The light that shows a fault.
    pub trouble: RpLight,
    /// The watchdog.
    pub watchdog: Peri<'static, peripherals::WATCHDOG>,
    /// The flash, for settings.
    pub flash: Peri<'static, peripherals::FLASH>,
}

/// Starts the chip at [`setup::MHZ`] from its crystal of 12 MHz. With 48 MHz, the PLL of USB is the only one that runs.
///
/// # Panics
/// Panics if the PLL cannot make it, which is decided by numbers alone.
pub fn start() -> Peripherals {
    let Ok(mut clocks) = ClockConfig::system_freq(CLOCK) else { panic!("the PLL makes it of 12 MHz") };
    if CLOCK == USB_CLOCK {
        clocks.sys_clk = SysClkConfig { src: SysClkSrc::PllUsb, div_int: 1, div_frac: 0 };
        if let Some(crystal) = &mut clocks.xosc {
            crystal.sys_pll = None;
        }
    }
    let mut config = Config::default();
    config.clocks = clocks;
    let peripherals = embassy_rp::init(config);
    #[cfg(feature = "rp2040")]
    if setup::MHZ < 120 {
        stop_unused_clocks();
    }
    peripherals
}

/// Stops the clocks of what no board uses: by the data sheet, a quarter of the current of all clocks while the core
/// sleeps.
#[cfg(feature = "rp2040")]
fn stop_unused_clocks() {
    CLOCKS.wake_en0().modify(|w| {
        w.set_clk_sys_i2c1(false);
        w.set_clk_sys_pio1(false);
        w.set_clk_sys_pwm(false);
        w.set_clk_rtc_rtc(false);
        w.set_clk_sys_rtc(false);
        w.set_clk_peri_spi0(false);
        w.set_clk_sys_spi0(false);
        w.set_clk_peri_spi1(false);
        w.set_clk_sys_spi1(false);
    });
    CLOCKS.wake_en1().modify(|w| {
        w.set_clk_peri_uart1(false);
        w.set_clk_sys_uart1(false);
        w.set_clk_usb_usbctrl(cfg!(feature = "usb"));
        w.set_clk_sys_usbctrl(cfg!(feature = "usb"));
    });
}

/// Gives the sensor its clock of 24 MHz at this pin. A module with an oscillator of its own needs no wire to it.
pub fn sensor_clock<T: GpoutPin>(pin: Peri<'static, T>) {
    let clock = Gpout::new(pin);
    clock.set_src(GpoutSrc::Sys);
    clock.set_div((CLOCK / SENSOR_CLOCK) as _, 0);
    clock.enable();
    // A dropped output would be disconnected.
    core::mem::forget(clock);
}

/// Returns whether the PIO keeps up with the pixel clock of so many data wires.
pub const fn keeps_up(wires: u8) -> bool {
    const PIXELS: u32 = SENSOR_CLOCK / if setup::FPS > WHOLE_FPS { 4 } else { 8 };
    const FEWEST: u32 = (PIO_CLOCKS * PIXELS * 8).div_ceil(CLOCK);
    FEWEST <= 1 || wires as u32 >= FEWEST
}

/// Answers for ever.
///
/// # Panics
/// Panics if the configuration does not fit the sensors' frames, the number of data wires is not 1, 4 or 8, or the PIO
/// does not keep up with them, or at a second call.
pub async fn run(wiring: RpWiring) -> ! {
    #[cfg(not(feature = "usb"))]
    let id = None;
    #[cfg(feature = "usb")]
    let mut wiring = wiring;
    #[cfg(feature = "usb")]
    let id = usb::chip_id(wiring.flash.reborrow()).map(|id| [id as u32, (id >> 32) as u32, 0]);
    let mut watchdog = ChipWatchdog::new(wiring.watchdog);
    let hung = watchdog.reset_reason() == Some(ResetReason::TimedOut);
    watchdog.pause_on_debug(true);
    watchdog.start(Duration::from_micros(HANGS.into()));
    assert!(keeps_up(wiring.camera.count), "the PIO does not keep up with so few data wires");
    let sensors = match wiring.camera.count {
        1 => WITH_1,
        4 => WITH_4,
        _ => WITH_8,
    };
    let area = Area { width: SIZE.width(), height: HEIGHT, border: BORDER, rows: ROWS };
    let Some(ring) = cortex_m::singleton!(: Blocks = Blocks::new()) else { panic!("the ring is taken once") };
    let signals = sensors[0].signals;
    let Some(camera) = Pio::new(wiring.pio, wiring.channels, RpIrqs, ring, wiring.camera, area, signals) else {
        panic!("the ring does not fit the picture, or the camera has not 1, 4 or 8 data wires");
    };
    #[cfg(feature = "settings")]
    let store = cortex_m::singleton!(: KeptSettings<RpFlash> =
        KeptSettings::new(RpFlash::new(wiring.flash), SECTORS, LAYOUT, node::RATE, longest_exposure(sensors)));
    #[cfg(not(feature = "settings"))]
    let store = cortex_m::singleton!(: FixedSettings = FixedSettings::new(LAYOUT));
    let line = cortex_m::singleton!(: Link<Serial, RpLight> = Link::new(wiring.line, wiring.trouble));
    let (Some(store), Some(line)) = (store, line) else { panic!("a board has one node") };
    let node = Node::<Rp, WIDTH, STRIPES> {
        sensors,
        store,
        camera,
        bus: wiring.bus,
        line,
        events: wiring.events,
        watchdog: Dog(watchdog),
        thermometer: RpThermometer::new(),
        hung,
        is_own_clock: false,
        id,
    };
    node::run(node).await
}

/// A light, which is lit while its pin is high.
pub type RpLight = Output<'static>;
