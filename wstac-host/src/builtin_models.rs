//! The models that come with the program, trained on simulated slides.

/// Makes the list of the names and contents of files in `models/path`, in `models`, and in `models/tradeoff`.
macro_rules! models {
    ($($path:literal)* ; $($shipped:literal)* ; $($variant:literal)*) => {
        /// The names and contents of the models: a static, as each part of the program has its own copy of a constant.
        pub(crate) static MODELS: &[(&str, &[u8])] = &[
            $(($path, include_bytes!(concat!("../models/path/", $path, ".wsm"))),)*
            $(($shipped, include_bytes!(concat!("../models/", $shipped, ".wsm"))),)*
            $(($variant, include_bytes!(concat!("../models/tradeoff/", $variant, ".wsm")))),*
        ];
        /// The names of those that only the study of speed against accuracy weighs.
        pub(crate) const VARIANTS: &[&str] = &[$($variant),*];
    };
}

models! {
    // Of the sample along the path: any speed, direction and length.
    "path-svm" "path-forest" "path-boosted"
    "taxel-path-svm" "taxel-path-forest" "taxel-path-boosted"
    // They read 16 mm of the path instead of 28 mm.
    "path-svm-16mm" "taxel-path-svm-16mm"
    // For `wstac model learn`.
    "embedding" "taxel-embedding";
    // Of the sample over time, as published: 100 to 200 mm/s in four directions.
    "svm" "forest" "boosted";
    // These are others, which the study of speed against accuracy weighs.
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
    "network-16-20f"
}
