//! The chip's temperature: the sensor at channel 18 of ADC3 (RM0433, 25.4.34; DS12110, 6.3.24).
//!
//! Nothing waits: a measurement that has begun is read when it is asked for again, about a second later.

use embassy_stm32::pac::adc::vals::{Adcaldif, Boost, Pcsel, Res, SampleTime};
use embassy_stm32::pac::adccommon::vals::Ckmode;
use embassy_stm32::pac::{ADC3, ADC3_COMMON, RCC};

use crate::node::Thermometer;

const CHANNEL: usize = 18;
/// The values that the factory has measured at 30 and at 110 °C, with 16 bits and 3.3 V.
const AT_30: *const u16 = 0x1FF1_E820 as *const u16;
const AT_110: *const u16 = 0x1FF1_E840 as *const u16;
/// The cycles for the start of the ADC's supply, 10 µs, at any clock of the core up to 96 MHz.
const SUPPLY: u32 = 960;

/// The sensor of the chip's temperature.
pub struct ChipThermometer {
    /// The numbers at 30 and at 110 °C.
    at: [u16; 2],
    step: AdcPhase,
}

/// The next thing to be done.
#[derive(Clone, Copy, PartialEq, Eq)]
enum AdcPhase {
    /// The ADC is being calibrated.
    Calibrate,
    /// The ADC starts.
    Enable,
    Measure,
}

/// Starts the ADC, which nobody else may use.
pub(crate) fn thermometer() -> ChipThermometer {
    RCC.ahb4enr().modify(|w| w.set_adc3en(true));
    // The clock is there two cycles of the bus later.
    let _ = RCC.ahb4enr().read();
    cortex_m::asm::dsb();
    // A quarter of the bus clock of at most 100 MHz.
    ADC3_COMMON.ccr().modify(|w| {
        w.set_ckmode(Ckmode::SYNC_DIV4);
        w.set_vsenseen(true);
    });
    ADC3.cr().modify(|w| {
        w.set_deeppwd(false);
        w.set_advregen(true);
        w.set_boost(Boost::LT25);
    });
    cortex_m::asm::delay(SUPPLY);
    ADC3.cr().modify(|w| {
        w.set_adcaldif(Adcaldif::SINGLE_ENDED);
        w.set_adcal(true);
    });
    // SAFETY: the chip has its own numbers there, in memory that is only read.
    #[allow(unsafe_code)]
    let at = unsafe { [AT_30.read_volatile(), AT_110.read_volatile()] };
    ChipThermometer { at, step: AdcPhase::Calibrate }
}

impl ChipThermometer {
    /// Returns the temperature of a number in tenths of a degree; `None` if the factory has left no numbers, or if no
    /// chip is as hot or cold.
    fn of(&self, number: u16) -> Option<i16> {
        let [low, high] = self.at.map(i32::from);
        let tenths = (i32::from(number) - low).checked_mul(800)?.checked_div(high - low)?.checked_add(300)?;
        i16::try_from(tenths).ok().filter(|tenths| (-600..=1600).contains(tenths))
    }
}

impl Thermometer for ChipThermometer {
    fn tenths(&mut self) -> Option<i16> {
        match self.step {
            AdcPhase::Calibrate if !ADC3.cr().read().adcal() => {
                ADC3.isr().write(|w| w.set_adrdy(true));
                ADC3.cr().modify(|w| w.set_aden(true));
                self.step = AdcPhase::Enable;
                None
            }
            AdcPhase::Enable if ADC3.isr().read().adrdy() => {
                ADC3.cfgr().modify(|w| w.set_res(Res::BITS16));
                // 810.5 cycles of 18 MHz are 45 µs; the sensor needs 9.
                ADC3.smpr(1).modify(|w| w.set_smp(CHANNEL - 10, SampleTime::CYCLES810_5));
                ADC3.pcsel().modify(|w| w.set_pcsel(CHANNEL, Pcsel::PRESELECTED));
                ADC3.sqr1().write(|w| w.set_sq(0, CHANNEL as u8));
                ADC3.cr().modify(|w| w.set_adstart(true));
                self.step = AdcPhase::Measure;
                None
            }
            AdcPhase::Measure if ADC3.isr().read().eoc() => {
                let number = ADC3.dr().read().rdata();
                ADC3.cr().modify(|w| w.set_adstart(true));
                self.of(number)
            }
            _ => None,
        }
    }
}
