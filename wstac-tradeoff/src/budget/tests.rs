use super::*;
use crate::map;
use crate::prices::Prices;

const PRICES: &str = r#"{"compiler": "c", "frame": "f", "cores": {"M4F": {
    "formats": {"GREY": {"1": {"frame": 64000, "flash": 20000, "ram": 4000}, "2": {"frame": 30000, "flash": 20100, "ram": 4000}}},
    "ln": {"fixed": {"frame": 0, "flash": 0, "ram": 0, "path_flash": 0}},
    "trigger": 300,
    "laws": {"published": {"event": 74000, "flash": 0, "ram": 0}, "edges": {"event": 22000, "flash": 1000, "ram": 0}},
    "models": {"svm.wsm": {"frame": 0, "sha256": "0", "laws": {"published": {"event": 40000, "flash": 65000, "ram": 1200}}}}}}}"#;

/// Returns rows of two strides without and with a model; the finer stride is the more accurate.
fn rows() -> Vec<Row> {
    let text = format!(
        "{}GREY,1,fixed,published,none,800,800,,,,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,\n\
         GREY,1,fixed,published,builtin:svm,800,800,80.00,78.00,82.00,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,\n\
         GREY,2,fixed,published,none,800,800,,,,,,,,,,4.00,9.00,360,90,1,0.000200,0.000100,0.000200,0.000200,58.0,\n\
         GREY,2,fixed,published,builtin:svm,800,800,79.00,77.00,81.00,,,,,,,4.00,9.00,360,90,1,0.000200,0.000100,0.000200,0.000200,58.0,\n\
         MJPEG,1,fixed,published,builtin:svm,800,800,90.00,77.00,81.00,,,,,,,4.00,9.00,360,0,1,0.000200,0.000100,0.000200,0.000200,38.0,\n",
        map::write(&[])
    );
    map::read("m", &text).unwrap()
}

fn found(budget: &str, by: By) -> Result<(u16, Option<String>, &'static str), String> {
    let (rows, prices) = (rows(), Prices::read("p", PRICES).unwrap());
    let best = best(&rows, &budget.parse()?, by, &prices, Core::M4F)?.best;
    Ok((best.setting.stride.get(), best.model.clone(), best.setting.format.name()))
}

#[test]
fn the_best_that_fits() {
    let svm = || Some("builtin:svm".to_owned());
    assert_eq!(found("M4F<65000", By::Specimen), Ok((1, svm(), "GREY")));
    assert_eq!(found("M4F<=64300", By::Specimen), Ok((1, svm(), "GREY")));
    assert_eq!(found("M4F<64300", By::Specimen), Ok((2, svm(), "GREY")));
    assert_eq!(found("m4f < 60k, flash<84K", By::Specimen), Ok((2, svm(), "GREY")));
    assert_eq!(found("flash<64K", By::Direction), Ok((1, None, "GREY")));
    // A quarter of the slides at stride 2 has no speed.
    assert_eq!(found("ram<8K", By::Speed), Ok((1, None, "GREY")));
    // No board reads MJPEG: it is selected only if no board is named.
    assert_eq!(found("frames<=40", By::Specimen), Ok((1, svm(), "MJPEG")));
    // It is selected only if no other format fits: with fewer slides it is more often the best by chance.
    assert_eq!(found("frames<100", By::Specimen), Ok((1, svm(), "GREY")));
    assert_eq!(found("FORMAT=mjpeg", By::Specimen), Ok((1, svm(), "MJPEG")));
    assert_eq!(found("stride=2,ln=fixed,model=none", By::Features), Ok((2, None, "GREY")));
}

#[test]
fn a_law_is_a_parameter() {
    let line = "GREY,1,fixed,edges,none,800,800,,,,,,,,,,1.00,2.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,";
    let text = map::write(&rows()) + line + "\n";
    let (rows, prices) = (map::read("m", &text).unwrap(), Prices::read("p", PRICES).unwrap());
    let best = |budget: &str| {
        let choice = best(&rows, &budget.parse().unwrap(), By::Speed, &prices, Core::M4F);
        choice.map(|choice| choice.best.setting.law)
    };
    assert_eq!(best("M4F.event<50k"), Ok(AnswerLaw::Edges));
    assert_eq!(best("flash<64K"), Ok(AnswerLaw::Edges));
    assert_eq!(best("flash<=20000"), Ok(AnswerLaw::Published));
    assert_eq!(best("law=published,flash<64K"), Ok(AnswerLaw::Published));
    assert!(best("law=coherence").unwrap_err().contains("no configuration of the map"));
}

#[test]
fn a_time_is_so_many_frames() {
    let budgets = ["latency<0.6s", "latency<600ms", "frames<18"];
    let [seconds, thousandths, frames] = budgets.map(|text| text.parse::<Budget>().unwrap().limits[0].clone());
    assert!(seconds.what == frames.what && (seconds.most - frames.most).abs() < 1e-9);
    assert!((thousandths.most - frames.most).abs() < 1e-9);
}

#[test]
fn the_nearest_miss_is_told() {
    let miss = found("M4F<20000", By::Specimen).unwrap_err();
    for part in [
        "nearest is GREY, stride 2, fixed ln, law published, model svm",
        "M4F: 30,300 instructions per frame, expected M4F<20000",
    ] {
        assert!(miss.contains(part), "{miss}");
    }
    let miss = found("flash<64K,M4F.event<120k", By::Specimen).unwrap_err();
    assert!(miss.contains("M4F: 85,000 bytes of flash, expected flash<64K") && !miss.contains("120k"), "{miss}");
    let miss = found("frames<38", By::Specimen).unwrap_err();
    assert!(miss.contains("38.0 frames, 1.27 s, to the answer, expected frames<38"), "{miss}");
    let miss = found("model=none", By::Specimen).unwrap_err();
    assert!(miss.contains("tells what --by is about"), "{miss}");
    assert!(found("format=RGB565", By::Specimen).unwrap_err().contains("no configuration of the map"));
    let miss = found("M0+<9M", By::Specimen).unwrap_err();
    assert!(miss.contains("M0: instructions per frame not known, expected M0+<9M"), "{miss}");
}

#[test]
fn speed_and_direction_wait_for_the_whole_sample() {
    let text =
        map::write(&rows()).replace("GREY,1,fixed,published,builtin:svm", "GREY,1,fixed,published,builtin:svm-20f");
    let early = |line: &str| line.replace("0.000100,58.0,", "0.000100,8.0,") + "\n";
    let is_early = |line: &str| line.contains("svm-20f");
    let text: String =
        text.lines().map(|line| if is_early(line) { early(line) } else { format!("{line}\n") }).collect();
    let (rows, prices) = (map::read("m", &text).unwrap(), Prices::read("p", PRICES).unwrap());
    let budget: Budget = "frames<=40,format=GREY".parse().unwrap();
    let best = |by| best(&rows, &budget, by, &prices, Core::M4F);
    assert_eq!(best(By::Specimen).unwrap().best.model.as_deref(), Some("builtin:svm-20f"));
    for by in [By::Speed, By::Direction] {
        assert!(best(by).unwrap_err().contains("58.0 frames, 1.93 s, to the answer"), "{by:?}");
    }
}

#[test]
fn a_cheaper_one_within_a_point_is_named() {
    let (rows, prices) = (rows(), Prices::read("p", PRICES).unwrap());
    let choice = |budget: &str| best(&rows, &budget.parse().unwrap(), By::Specimen, &prices, Core::M4F).unwrap();
    assert_eq!(choice("M4F<1M").nearly.map(|row| row.setting.stride.get()), Some(2));
    // It is the cheapest itself.
    assert_eq!(choice("M4F<40k").nearly, None);
}

#[test]
fn the_nearest_miss_misses_fewest_terms() {
    // Without flash both strides miss only one term; the coarser one misses two of these, each by less.
    let miss = found("M4F<1,frames<1,format=GREY,stride=1", By::Specimen).unwrap_err();
    assert!(miss.contains("M4F<1") && miss.contains("frames<1"), "{miss}");
    let miss = found("M4F<60k,frames<50,M4F.event<1M", By::Specimen).unwrap_err();
    assert!(miss.contains("stride 2") && miss.contains("frames<50") && !miss.contains("M4F<60k"), "{miss}");
}

#[test]
fn a_model_that_the_map_does_not_have_is_named() {
    let check = |budget: &str| budget.parse::<Budget>().unwrap().check_model(&rows());
    assert_eq!(
        [check("model=svm"), check("model=builtin:svm"), check("model=none"), check("ln=libm")],
        [const { Ok(()) }; 4]
    );
    assert!(check("model=nosuch").unwrap_err().contains("\"nosuch\", expected one of none, svm"));
}

#[test]
fn what_is_wrong_is_named() {
    for (text, parts) in [
        ("", ["term \"\"", "M4F"]),
        ("M5<3", ["term \"M5<3\"", "\"M5\", expected M0"]),
        ("RP2040<3", ["\"RP2040\", expected M0", "help: an RP2040 is an M0"]),
        ("M4F@64MHz<3", ["\"M4F@64MHz\"", "help: name the core alone: 1 MHz is some 1,900 instructions"]),
        ("M4F<fast", ["\"fast\"", "a number above 0"]),
        ("M4F<-3", ["\"-3\"", "k, K, M"]),
        ("M4F=3", ["M4F with =", "< or <="]),
        ("M4F.flash<3", ["\"M4F.flash\"", ".event"]),
        ("flash<64Q", ["\"64Q\"", "K, k, M"]),
        ("format=NV12", ["\"NV12\"", "GREY, RGB24"]),
        ("law=paper", ["\"paper\"", "coherence, edges, published"]),
        ("law=edges,law=edges", ["term \"law=edges\"", "stands twice"]),
        ("ln=exact", ["\"exact\"", "fixed, libm, micromath"]),
        ("stride=4", ["\"4\"", "1, 2, 3, 5"]),
        ("model=", ["model=", "a name is missing"]),
        ("frames<5h", ["\"5h\"", "a number above 0"]),
        ("latency<0.6", ["\"0.6\"", "0.6s or 600ms"]),
        ("host<20us", ["term \"host<20us\": was removed", "help: ci/bench"]),
        ("M4F<1e306k", ["\"1e306k\"", "a number above 0"]),
        ("ln=fixed,ln=libm", ["term \"ln=libm\"", "stands twice"]),
        ("format===GREY", ["\"==GREY\"", "GREY, RGB24"]),
        ("frames<1,,", ["term \"\"", "nothing between commas"]),
        ("M4F>5", ["term \"M4F>5\"", "expected < or <="]),
        ("M4F<60,000", ["term \"000\"", "60000 or 60k"]),
        ("M4F", ["term \"M4F\"", "no limit"]),
        ("format=NV16", ["MJPEG", "YUYV exact, YUYV linear"]),
    ] {
        let message = text.parse::<Budget>().unwrap_err();
        for part in parts {
            assert!(message.contains(part), "{text:?} gave {message:?}, expected {part:?}");
        }
    }
}
