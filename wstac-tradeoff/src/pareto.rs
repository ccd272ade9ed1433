//! Configurations for which no cheaper one is as good.

use super::prices::{Core, Price, Prices};
use super::row::Row;

/// Ratio of prices up to which they count as equal; each price is a sum that is right within 1 %.
const SAME_PRICE: f64 = 1.02;
/// Accuracy in percent of slides by which a more expensive row must be better; sensors differ by more.
const SAME_ACCURACY: f64 = 1.0;

/// Returns the rows with a board's price and a specimen accuracy that no cheaper row reaches, the fastest first.
///
/// There are three costs: instructions per second (of 30 frames and an event), flash, and frames to the answer. Rows
/// are examined from the fastest on. A row is left out if a row that was kept costs no more in all three, within 2 %.
/// That row must also have its accuracy or more, of specimens and of objects, within 1 percentage point.
pub fn unbeaten<'r>(rows: &'r [Row], prices: &Prices, core: Core) -> Vec<(&'r Row, Price)> {
    let priced = |row: &'r Row| {
        let price = prices.of(core, &row.setting, row.model.as_deref())?;
        // A model that was not counted adds the same to all its rows, which are only compared with each other.
        let counted = price.instructions_per_second().zip(price.flash);
        let rest = prices.of(core, &row.setting, None)?;
        let (instructions, flash) = counted.or(rest.instructions_per_second().zip(rest.flash))?;
        let costs = [instructions as f64, flash as f64, row.found.latency?];
        Some((row, price, costs, [row.found.accuracy[0]?.mean, row.found.objects.unwrap_or_default()]))
    };
    let mut all: Vec<_> = rows.iter().filter_map(priced).collect();
    all.sort_by(|a, b| {
        let costs = a.2.iter().zip(&b.2).map(|(a, b)| a.total_cmp(b));
        costs.reduce(std::cmp::Ordering::then).unwrap_or(std::cmp::Ordering::Equal).then(b.3[0].total_cmp(&a.3[0]))
    });
    let mut kept: Vec<(&Row, Price, [f64; 3], [f64; 2])> = Vec::new();
    for one in all {
        let is_beaten = kept.iter().any(|other| {
            let is_alike = (one.1.flash.is_some() && other.1.flash.is_some()) || one.0.model == other.0.model;
            let is_cheaper = is_alike && other.2.iter().zip(&one.2).all(|(other, one)| *other <= one * SAME_PRICE);
            is_cheaper && other.3.iter().zip(one.3).all(|(other, one)| *other >= one - SAME_ACCURACY)
        });
        if !is_beaten {
            kept.push(one);
        }
    }
    kept.into_iter().map(|(row, price, ..)| (row, price)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map;

    #[test]
    fn what_a_cheaper_one_is_as_good_as_is_left_out() {
        let prices = r#"{"compiler": "c", "frame": "f", "cores": {"M0": {
            "formats": {"GREY": {"1": {"frame": 600, "flash": 20, "ram": 4}, "2": {"frame": 300, "flash": 20, "ram": 4}, "3": {"frame": 200, "flash": 20, "ram": 4}}},
            "ln": {"fixed": {"frame": 0, "flash": 0, "ram": 0, "path_flash": 0}, "libm": {"frame": 50, "flash": 3, "ram": 0, "path_flash": 3}, "micromath": {"frame": 90, "flash": 3, "ram": 0, "path_flash": 3}},
            "trigger": 1, "laws": {"published": {"event": 2, "flash": 0, "ram": 0}},
            "models": {"a.wsm": {"frame": 0, "laws": {"published": {"event": 4, "flash": 6, "ram": 1}}}}}}}"#;
        let rest = "800,80.00,78.00,82.00,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,";
        let lines = [
            format!("GREY,1,fixed,published,builtin:a,800,{rest}"),
            format!("GREY,2,fixed,published,builtin:a,800,{}", rest.replace("80.00", "77.00")),
            format!("GREY,2,libm,published,builtin:a,800,{}", rest.replace("80.00", "77.50")),
            format!("GREY,3,fixed,published,builtin:a,800,{}", rest.replace("80.00", "75.00")),
            // First more expensive and better by less than a point; then more expensive, no better, and sooner.
            format!("GREY,1,libm,published,builtin:a,800,{}", rest.replace("80.00", "80.90")),
            format!("GREY,1,micromath,published,builtin:a,800,{}", rest.replace("58.0", "30.0")),
            "GREY,3,fixed,published,none,800,800,,,,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,"
                .to_owned(),
        ];
        let rows = map::read("m", &format!("{}{}\n", map::write(&[]), lines.join("\n"))).unwrap();
        let prices = Prices::read("p", prices).unwrap();
        let strides: Vec<u16> =
            unbeaten(&rows, &prices, Core::M0).iter().map(|(row, _)| row.setting.stride.get()).collect();
        assert_eq!(strides, [3, 2, 1, 1]);
    }
}
