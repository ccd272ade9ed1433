//! STM32 with a DCMI: what their boards share. A board is a file in `src/bin` with its pins and its clock, and a row
//! with its memories in `build/link.rs`.
//!
//! A chip is a module with its clocks and the peripherals that it uses: `h743`, also for the STM32H747, or `u575`.
//!
//! The parts that no board chooses: the camera interface with a stream of the chip's DMA, the line to the host on a
//! USART of the chip. A pin of the wrong function does not compile.

mod bus;
#[cfg_attr(feature = "h7", path = "h743/mod.rs")]
#[cfg_attr(feature = "u575", path = "u575/mod.rs")]
mod chip;
#[cfg(feature = "settings")]
mod flash;
mod usart;

pub use bus::{SensorBus, SensorPower};
pub use chip::*;
pub use usart::usart;

use core::convert::Infallible;
use core::mem::MaybeUninit;

use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, Pull, Speed};
use embassy_stm32::rcc::{Mco, McoConfig};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, bind_interrupts, dcmi, peripherals, uid};
use embedded_hal::digital::{ErrorType, OutputPin};
use wstac_core::layout::{FrameSize, Layout};

#[cfg(feature = "settings")]
use self::flash::{BoardFlash, SECTORS};
use crate::link::Link;
use crate::node::{self, Board, HANGS, Node, Watchdog};
#[cfg(feature = "settings")]
use crate::sensor::longest_exposure;
use crate::sensor::{
    CameraSensor, WHOLE_FPS, gc2145::GC2145, hm01b0::HM01B0, hm0360::HM0360, mt9m114::MT9M114, ov2640::OV2640,
    ov5640::OV5640, ov7670::OV7670, ov7690::OV7690, ov7692::OV7692, ov7725::OV7725,
};
use crate::serial::Serial;
#[cfg(not(feature = "settings"))]
use crate::settings_store::FixedSettings;
#[cfg(feature = "settings")]
use crate::settings_store::KeptSettings;
use crate::setup;
use crate::stripes::Ring;
use crate::stripes::dcmi::{Dcmi, DcmiInterrupts, Stream};

/// The core's clock in MHz with which the camera interface takes the pixels of every sensor: 2.5 of its clocks for one.
const ANY_SENSOR_MHZ: u32 = 60;
/// The sensors that are looked for, in this order. All produce frames of one size.
static SENSORS: &[CameraSensor] = node::in_time(if MHZ < ANY_SENSOR_MHZ {
    &[HM01B0]
} else if setup::FPS > WHOLE_FPS {
    &[OV7690, OV7692, OV7725, HM0360, HM01B0]
} else {
    &[OV7690, OV7692, OV7725, OV7670, OV2640, GC2145, OV5640, MT9M114, HM0360, HM01B0]
});
/// The size of the frames of all sensors.
const SIZE: FrameSize = OV7690.size;
/// The rows of a stripe.
const ROWS: u16 = 8;

/// The layout that is compiled in.
const LAYOUT: Layout = match setup::layout(SIZE) {
    Ok(layout) => layout,
    Err(_) => panic!("the configuration's [layout] does not fit frames of 320 x 240"),
};
/// The bytes of a row.
const WIDTH: usize = SIZE.width() as usize;
/// The stripes of a frame.
const STRIPES: usize = (SIZE.height() / ROWS) as usize;
/// The words of a stripe.
const WORDS: usize = WIDTH * ROWS as usize / 4;

bind_interrupts!(
    /// The interrupts of the camera interface, its DMA and the serial line.
    pub struct Irqs {
        #[cfg(feature = "h7")]
        DCMI => DcmiInterrupts;
        #[cfg(feature = "h7")]
        DMA1_STREAM0 => DcmiInterrupts;
        #[cfg(feature = "h743")]
        USART3 => usart::UsartInterrupts;
        #[cfg(feature = "u575")]
        DCMI_PSSI => DcmiInterrupts;
        #[cfg(feature = "u575")]
        GPDMA1_CHANNEL0 => DcmiInterrupts;
        #[cfg(any(feature = "h747", feature = "u575"))]
        USART1 => usart::UsartInterrupts;
    }
);

/// The parts of an STM32.
pub struct Stm32;

impl Board for Stm32 {
    type Camera = Dcmi;
    type Bus = SensorBus;
    type Line = Serial;
    type Light = Light;
    type Watchdog = IndependentWatchdog<'static, WatchdogPart>;
    #[cfg(feature = "settings")]
    type SettingsStore = KeptSettings<BoardFlash>;
    #[cfg(not(feature = "settings"))]
    type SettingsStore = FixedSettings;
    type Thermometer = ChipThermometer;
}

impl Watchdog for IndependentWatchdog<'_, WatchdogPart> {
    fn pet(&mut self) {
        IndependentWatchdog::pet(self);
    }
}

/// A board's pins, and the peripherals behind them.
pub struct Wiring {
    /// The camera's pins are set up.
    pub camera: CameraPins,
    /// The camera interface.
    pub dcmi: Peri<'static, peripherals::DCMI>,
    /// The stream of the camera interface's words.
    pub stream: Peri<'static, Stream>,
    /// The sensor's clock of 24 MHz.
    pub clock: SensorClock,
    /// The sensor's bus.
    pub bus: SensorBus,
    /// The line to the host.
    pub line: Serial,
    /// The light that changes with every event.
    pub events: Light,
    /// The light that shows a fault.
    pub trouble: Light,
    /// The watchdog.
    pub watchdog: Peri<'static, WatchdogPart>,
    /// The flash, for settings.
    pub flash: Peri<'static, peripherals::FLASH>,
}

/// The sensor's clock, which runs.
pub struct SensorClock(());

impl SensorClock {
    /// Puts the chip's clock of 24 MHz out at PA8.
    pub fn output(output: Peri<'static, ClockOutput>, pin: Peri<'static, peripherals::PA8>) -> Self {
        let _ = Mco::new(output, pin, SENSOR_CLOCK, McoConfig::default());
        Self(())
    }
}

/// Answers for ever. `has_crystal` is what [`start`] returned.
///
/// # Panics
/// Panics if the configuration does not fit the sensors' frames, or at a second call.
pub async fn run(has_crystal: bool, wiring: Wiring) -> ! {
    stop_watchdog_in_debugger();
    let mut watchdog = IndependentWatchdog::new(wiring.watchdog, HANGS);
    watchdog.unleash();
    let hung = take_hung();
    let Some(camera) = Dcmi::new(wiring.dcmi, wiring.stream, Irqs, ring(), SIZE, ROWS, OV7690.signals) else {
        panic!("the ring does not fit the frames, or is more than the DMA counts");
    };
    #[cfg(feature = "settings")]
    let store = cortex_m::singleton!(: KeptSettings<BoardFlash> =
        KeptSettings::new(BoardFlash::new(wiring.flash), SECTORS, LAYOUT, node::RATE, longest_exposure(SENSORS)));
    #[cfg(not(feature = "settings"))]
    let store = cortex_m::singleton!(: FixedSettings = FixedSettings::new(LAYOUT));
    let line = cortex_m::singleton!(: Link<Serial, Light> = Link::new(wiring.line, wiring.trouble));
    let (Some(store), Some(line)) = (store, line) else { panic!("a board has one node") };
    let node = Node::<Stm32, WIDTH, STRIPES> {
        sensors: SENSORS,
        store,
        camera,
        bus: wiring.bus,
        line,
        events: wiring.events,
        watchdog,
        thermometer: thermometer(),
        hung,
        is_own_clock: !has_crystal,
        id: Some(chip_id()),
    };
    node::run(node).await
}

/// Returns the ring, in memory that the DMA reaches (`build/link.rs`).
///
/// # Panics
/// Panics at a second call.
#[allow(unsafe_code)]
fn ring() -> &'static mut Ring<WORDS> {
    #[unsafe(link_section = ".uninit.ring")]
    static mut RING: MaybeUninit<Ring<WORDS>> = MaybeUninit::uninit();
    assert!(cortex_m::singleton!(: () = ()).is_some(), "the ring is taken once");
    let ring = &raw mut RING;
    // SAFETY: words of zeros are a ring, which is lent once.
    unsafe {
        ring.write_bytes(0, 1);
        &mut *ring.cast()
    }
}

/// Returns the unique number of the chip, its lowest word first.
fn chip_id() -> [u32; 3] {
    let uid = uid::uid();
    let mut id = [0; 3];
    for (number, word) in id.iter_mut().zip(uid.as_chunks::<4>().0) {
        *number = u32::from_le_bytes(*word);
    }
    id
}

/// The camera's pins, which are set up.
pub struct CameraPins(());

macro_rules! camera_pins {
    ($($pin:ident: $function:ident),*) => {
        impl CameraPins {
            /// Sets the pins up. Each has a pull-down, so that a wire that is off does not float.
            #[expect(clippy::too_many_arguments, reason = "a pin each, and a pin of another function does not compile")]
            pub fn new($($pin: Peri<'static, impl dcmi::$function<peripherals::DCMI>>),*) -> Self {
                let pins: [(u8, Peri<'static, AnyPin>); 11] = [$(($pin.af_num(), $pin.into())),*];
                for (function, pin) in pins {
                    let mut pin = Flex::new(pin);
                    pin.set_as_af_unchecked(function, AfType::input(Pull::Down));
                    // A dropped pin would be disconnected.
                    core::mem::forget(pin);
                }
                Self(())
            }
        }
    };
}

camera_pins!(
    d0: D0Pin, d1: D1Pin, d2: D2Pin, d3: D3Pin, d4: D4Pin, d5: D5Pin, d6: D6Pin, d7: D7Pin, vsync: VSyncPin,
    href: HSyncPin, pclk: PixClkPin
);

/// A light. It is lit when it is set high, whatever its pin needs for that.
pub struct Light {
    pin: Output<'static>,
    lit: Level,
}

impl Light {
    /// Creates a light that is off. It is lit while its pin has this level.
    pub fn new(pin: Peri<'static, AnyPin>, lit: Level) -> Self {
        let off = if lit == Level::High { Level::Low } else { Level::High };
        Self { pin: Output::new(pin, off, Speed::Low), lit }
    }
}

impl ErrorType for Light {
    type Error = Infallible;
}

impl OutputPin for Light {
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.pin.set_level(self.lit);
        Ok(())
    }

    fn set_low(&mut self) -> Result<(), Infallible> {
        self.pin.set_level(if self.lit == Level::High { Level::Low } else { Level::High });
        Ok(())
    }
}
