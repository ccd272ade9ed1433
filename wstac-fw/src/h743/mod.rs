//! STM32H743: what its boards share. A board is a file in `src/bin` with its pins and its clock, and a row with its
//! memories in `build/link.rs`.
//!
//! The parts that no board chooses: the camera interface with stream 0 of DMA1, a clock for the sensor at PA8, the
//! sensor's bus on I2C1, the line to the host on USART3. A pin of the wrong function does not compile.

mod bus;
#[cfg(feature = "settings")]
mod flash;
mod start;
mod thermometer;
mod usart;
#[cfg(feature = "usb")]
mod usb;

pub use bus::{SensorBus, SensorPower};
pub use start::{Crystal, start};
pub use thermometer::ChipThermometer;
pub use usart::usart3;

use core::convert::Infallible;
use core::mem::MaybeUninit;

use embassy_executor::Spawner;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, Pull, Speed};
use embassy_stm32::pac::{DBGMCU, RCC};
use embassy_stm32::rcc::{Mco, Mco1Source, McoConfig};
use embassy_stm32::usart::{RxPin, TxPin};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, bind_interrupts, dcmi, peripherals, uid};
use embedded_hal::digital::{ErrorType, OutputPin};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::wire::Bootloader;

#[cfg(feature = "settings")]
use self::flash::{BoardFlash, SECTORS};
use crate::link::{EnterBootloader, Link};
use crate::node::{self, Board, HANGS, Node, Watchdog};
use crate::restart::restart;
use crate::sensor::gc2145::GC2145;
use crate::sensor::hm01b0::HM01B0;
use crate::sensor::hm0360::HM0360;
#[cfg(feature = "settings")]
use crate::sensor::longest_exposure;
use crate::sensor::ov2640::OV2640;
use crate::sensor::ov5640::OV5640;
use crate::sensor::ov7670::OV7670;
use crate::sensor::ov7690::OV7690;
use crate::sensor::ov7692::OV7692;
use crate::sensor::ov7725::OV7725;
use crate::sensor::{CameraSensor, WHOLE_FPS};
use crate::serial::Serial;
#[cfg(not(feature = "settings"))]
use crate::settings_store::FixedSettings;
#[cfg(feature = "settings")]
use crate::settings_store::KeptSettings;
use crate::setup;
use crate::stripes::Ring;
use crate::stripes::dcmi::{Dcmi, DcmiInterrupts};

/// The sensors that are looked for, in this order. All produce frames of one size.
static SENSORS: &[CameraSensor] = if setup::FPS > WHOLE_FPS {
    &[OV7690, OV7692, OV7725, HM0360, HM01B0]
} else {
    &[OV7690, OV7692, OV7725, OV7670, OV2640, GC2145, OV5640, HM0360, HM01B0]
};
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
        DCMI => DcmiInterrupts;
        DMA1_STREAM0 => DcmiInterrupts;
        USART3 => usart::UsartInterrupts;
    }
);

/// The parts of an STM32H743.
pub struct H743;

impl Board for H743 {
    type Camera = Dcmi;
    type Bus = SensorBus;
    type Line = Serial;
    type Light = Light;
    type Watchdog = IndependentWatchdog<'static, peripherals::IWDG1>;
    #[cfg(feature = "settings")]
    type SettingsStore = KeptSettings<BoardFlash>;
    #[cfg(not(feature = "settings"))]
    type SettingsStore = FixedSettings;
    type Thermometer = ChipThermometer;
}

impl Watchdog for IndependentWatchdog<'_, peripherals::IWDG1> {
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
    pub stream: Peri<'static, peripherals::DMA1_CH0>,
    /// The output of the sensor's clock, 24 MHz.
    pub clock: (Peri<'static, peripherals::MCO1>, Peri<'static, peripherals::PA8>),
    /// The sensor's bus.
    pub bus: SensorBus,
    /// The line to the host.
    pub line: Serial,
    /// The light that changes with every event.
    pub events: Light,
    /// The light that shows a fault.
    pub trouble: Light,
    /// The watchdog.
    pub watchdog: Peri<'static, peripherals::IWDG1>,
    /// The flash, for settings.
    pub flash: Peri<'static, peripherals::FLASH>,
}

/// The word that OpenMV's boot loader looks at, the last one of the DTCM, and its value that keeps it waiting for a
/// program.
const MAGIC: *mut u32 = 0x2001_FFFC as *mut u32;
const STAY: u32 = 0xB007_10AD;

/// OpenMV's boot loader.
pub const OPENMV_BOOTLOADER: EnterBootloader = (Bootloader::Dfu, || {
    cortex_m::interrupt::disable();
    // SAFETY: the memory is there, and nothing runs any more that uses it.
    #[allow(unsafe_code)]
    unsafe {
        MAGIC.write_volatile(STAY);
    }
    cortex_m::asm::dsb();
    restart()
});

/// Starts the line of a board with USB: that, or a UART without the feature `usb`. A host may start the boot loader
/// over USB if the program can.
pub fn line(
    spawner: Spawner,
    (otg, plus, minus): (
        Peri<'static, peripherals::USB_OTG_FS>,
        Peri<'static, peripherals::PA12>,
        Peri<'static, peripherals::PA11>,
    ),
    bootloader: Option<EnterBootloader>,
    (usart, transmit, receive, baud): (
        Peri<'static, peripherals::USART3>,
        Peri<'static, impl TxPin<peripherals::USART3>>,
        Peri<'static, impl RxPin<peripherals::USART3>>,
        u32,
    ),
) -> Serial {
    #[cfg(feature = "usb")]
    {
        let _ = (usart, transmit, receive, baud);
        usb::usb(otg, (plus, minus), spawner, bootloader)
    }
    #[cfg(not(feature = "usb"))]
    {
        let _ = (spawner, otg, plus, minus, bootloader);
        usart3(usart, Irqs, transmit, receive, baud)
    }
}

/// Answers for ever. `has_crystal` is what [`start`] returned.
///
/// # Panics
/// Panics if the configuration does not fit the sensors' frames, or at a second call.
pub async fn run(has_crystal: bool, wiring: Wiring) -> ! {
    // It waits while a debugger halts the core.
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
    let mut watchdog = IndependentWatchdog::new(wiring.watchdog, HANGS);
    watchdog.unleash();
    let hung = RCC.rsr().read().iwdg1rstf();
    RCC.rsr().modify(|w| w.set_rmvf(true));
    let _clock = Mco::new(wiring.clock.0, wiring.clock.1, Mco1Source::PLL1_Q, McoConfig::default());
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
    let node = Node::<H743, WIDTH, STRIPES> {
        sensors: SENSORS,
        store,
        camera,
        bus: wiring.bus,
        line,
        events: wiring.events,
        watchdog,
        thermometer: ChipThermometer::new(),
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

impl CameraPins {
    /// Sets the pins up. Each has a pull-down, so that a wire that is off does not float.
    #[expect(clippy::too_many_arguments, reason = "a pin each, and a pin of another function does not compile")]
    pub fn new(
        d0: Peri<'static, impl dcmi::D0Pin<peripherals::DCMI>>,
        d1: Peri<'static, impl dcmi::D1Pin<peripherals::DCMI>>,
        d2: Peri<'static, impl dcmi::D2Pin<peripherals::DCMI>>,
        d3: Peri<'static, impl dcmi::D3Pin<peripherals::DCMI>>,
        d4: Peri<'static, impl dcmi::D4Pin<peripherals::DCMI>>,
        d5: Peri<'static, impl dcmi::D5Pin<peripherals::DCMI>>,
        d6: Peri<'static, impl dcmi::D6Pin<peripherals::DCMI>>,
        d7: Peri<'static, impl dcmi::D7Pin<peripherals::DCMI>>,
        vsync: Peri<'static, impl dcmi::VSyncPin<peripherals::DCMI>>,
        href: Peri<'static, impl dcmi::HSyncPin<peripherals::DCMI>>,
        pclk: Peri<'static, impl dcmi::PixClkPin<peripherals::DCMI>>,
    ) -> Self {
        let pins: [(u8, Peri<'static, AnyPin>); 11] = [
            (d0.af_num(), d0.into()),
            (d1.af_num(), d1.into()),
            (d2.af_num(), d2.into()),
            (d3.af_num(), d3.into()),
            (d4.af_num(), d4.into()),
            (d5.af_num(), d5.into()),
            (d6.af_num(), d6.into()),
            (d7.af_num(), d7.into()),
            (vsync.af_num(), vsync.into()),
            (href.af_num(), href.into()),
            (pclk.af_num(), pclk.into()),
        ];
        for (function, pin) in pins {
            let mut pin = Flex::new(pin);
            pin.set_as_af_unchecked(function, AfType::input(Pull::Down));
            // A dropped pin would be disconnected.
            core::mem::forget(pin);
        }
        Self(())
    }
}

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
