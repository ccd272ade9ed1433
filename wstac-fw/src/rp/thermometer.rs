//! The chip's temperature: the sensor at the ADC's channel 4 (RP2040 data sheet, 4.9.5; RP2350 data sheet, 12.4.6, in
//! its package of 60 pins).
//!
//! Nothing waits: a measurement that has begun is read when it is asked for again, about a second later.

use embassy_rp::pac::ADC;

use crate::node::Thermometer;

const CHANNEL: u8 = 4;
/// The microvolts at 27 °C, and those by which a degree lowers them.
const AT_27: i32 = 706_000;
const DEGREE: i32 = 1721;

/// The sensor of the chip's temperature. The reference of its voltage is the board's 3.3 V, so that an error of 1 %
/// there is one of four degrees here.
pub struct RpThermometer {
    has_begun: bool,
}

impl RpThermometer {
    /// Switches the sensor on. Nobody else may use the ADC.
    pub(super) fn new() -> Self {
        ADC.cs().write(|w| {
            w.set_en(true);
            w.set_ts_en(true);
            w.set_ainsel(CHANNEL);
        });
        Self { has_begun: false }
    }
}

impl Thermometer for RpThermometer {
    fn tenths(&mut self) -> Option<i16> {
        let state = ADC.cs().read();
        if !state.ready() {
            return None;
        }
        let number = self.has_begun && !state.err();
        let tenths = if number { of(ADC.result().read().result()) } else { None };
        ADC.cs().modify(|w| {
            w.set_err(true);
            w.set_start_once(true);
        });
        self.has_begun = true;
        tenths
    }
}

/// Returns the temperature of a number of 12 bits in tenths of a degree; `None` if no chip is as hot or cold.
fn of(number: u16) -> Option<i16> {
    // 3.3 V are 4096: 825 mV are 1024. The number is below 4096, so the product fits.
    let microvolts = (u32::from(number & 0xFFF) * 825_000 / 1024) as i32;
    let tenths = (270 - (microvolts - AT_27) * 10 / DEGREE) as i16;
    (-600..=1600).contains(&tenths).then_some(tenths)
}
