//! The models that the map has beside the shipped ones: a line each.

/// Makes the list: names of files in `wstac-linux/trade/models`.
macro_rules! models {
    ($($name:literal)*) => {
        /// Names and contents.
        pub const MODELS: &[(&str, &[u8])] =
            &[$(($name, include_bytes!(concat!("../../trade/models/", $name, ".wsm")))),*];
    };
}

models! {}
