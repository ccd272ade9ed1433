//! The models that the map has beside the shipped ones: a line each.

/// Makes the list: names of files in `wstac-host/models/tradeoff`.
macro_rules! models {
    ($($name:literal)*) => {
        /// Names and contents.
        pub const MODELS: &[(&str, &[u8])] =
            &[$(($name, include_bytes!(concat!("../models/tradeoff/", $name, ".wsm")))),*];
    };
}

models! {
    "svm-20f"
    "svm-30f"
    "svm-40f"
    "svm-50f"
    "svm-60f"
    "svm-int8"
    "ovr"
    "ovr-20f"
    "ovr-30f"
    "ovr-40f"
    "ovr-50f"
    "ovr-60f"
    "ovr-int8"
    "forest-10"
    "forest-25"
    "forest-25-20f"
    "forest-25-30f"
    "forest-25-40f"
    "forest-25-50f"
    "forest-25-60f"
    "forest-depth10"
    "forest-depth6"
    "boosted-10"
    "boosted-30"
    "boosted-30-20f"
    "boosted-30-30f"
    "boosted-30-40f"
    "boosted-30-50f"
    "boosted-30-60f"
}
