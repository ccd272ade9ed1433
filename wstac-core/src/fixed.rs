//! Numbers with 16 fraction bits: multipliers and margins, so that every platform decides alike.

/// A number from 0 to below 65536 with 16 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Q16(u32);

impl Q16 {
    /// The number one.
    pub const ONE: Self = Self(1 << 16);

    /// Returns the number nearest to `x`; ties round up. Returns `None` if `x` is not a number from 0 to below 65536.
    pub const fn new(x: f64) -> Option<Self> {
        let scaled = x * 65_536.0 + 0.5;
        // False for NaN too.
        if x >= 0.0 && scaled < 4_294_967_296.0 { Some(Self(scaled as u32)) } else { None }
    }

    /// Returns the number in units of 2^-16.
    pub const fn bits(self) -> u32 {
        self.0
    }
}
