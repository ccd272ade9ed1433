//! Keys of a scene's tables, and the messages for values out of range.

/// Defines a table of a scene's file: its keys with their defaults, and for some numbers the range, both ends included.
macro_rules! key_table {
    ($(#[$of:meta])* pub struct $name:ident {
        $($(#[$about:meta])* pub $key:ident: $type:ty = $default:expr $(, in $least:literal..=$most:literal)?;)*
    }) => {
        $(#[$of])*
        pub struct $name {
            $($(#[$about])* pub $key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }

        impl $name {
            /// Checks the keys that have a range.
            ///
            /// # Errors
            /// A number is out of range; the message names the key, the value found and the values expected.
            fn check_ranges(&self) -> Result<(), String> {
                $($($crate::keys::within(stringify!($key), self.$key, $least, $most)?;)?)*
                Ok(())
            }
        }
    };
}
pub(crate) use key_table;

/// Checks that a number is at least `least` and at most `most`; NaN is not.
///
/// # Errors
/// The number is out of range; the message names the key, the value found and the values expected.
pub(crate) fn within(key: &str, found: f64, least: f64, most: f64) -> Result<(), String> {
    if found >= least && found <= most {
        return Ok(());
    }
    Err(format!("{key} is {found}, expected {least} to {most}"))
}
