//! Configurations that no other one beats in everything.

use super::prices::{Core, Price, Prices};
use super::row::Row;

/// Rows with a board's price and a specimen's accuracy such that none is at least as accurate, as fast and as small, and better in one of
/// these; the fastest first. Fast is fewest instructions a second: of 30 frames and an event.
pub fn front<'r>(rows: &'r [Row], prices: &Prices, core: Core) -> Vec<(&'r Row, Price)> {
    let priced = |row: &'r Row| {
        let price = prices.of(core, &row.front, row.model.as_deref())?;
        Some((row, price, row.found.accuracy[0]?.mean))
    };
    let all: Vec<(&Row, Price, f64)> = rows.iter().filter_map(priced).collect();
    let beats = |a: &(&Row, Price, f64), b: &(&Row, Price, f64)| {
        let no_worse = a.2 >= b.2 && a.1.second() <= b.1.second() && a.1.flash <= b.1.flash;
        no_worse && (a.2 > b.2 || a.1.second() < b.1.second() || a.1.flash < b.1.flash)
    };
    let mut left: Vec<_> = all
        .iter()
        .filter(|one| !all.iter().any(|other| beats(other, one)))
        .map(|(row, price, _)| (*row, *price))
        .collect();
    left.sort_by_key(|(_, price)| price.second());
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::map;

    #[test]
    fn what_is_beaten_in_everything_is_left_out() {
        let prices = r#"{"compiler": "c", "frame": "f", "cores": {"M0": {
            "formats": {"GREY": {"1": {"frame": 600, "flash": 20, "ram": 4}, "2": {"frame": 300, "flash": 20, "ram": 4}, "3": {"frame": 200, "flash": 20, "ram": 4}}},
            "ln": {"fixed": {"frame": 0, "flash": 0, "ram": 0}, "libm": {"frame": 5, "flash": 3, "ram": 0}},
            "trigger": 1, "speed": 1, "direction": 1, "models": {"a.wsm": {"event": 4, "flash": 6, "ram": 1}}}}}"#;
        let rest = "800,80.00,78.00,82.00,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,9000,3000";
        let lines = [
            format!("GREY,1,fixed,a,800,{rest}"),
            format!("GREY,2,fixed,a,800,{}", rest.replace("80.00", "79.00")),
            format!("GREY,2,libm,a,800,{}", rest.replace("80.00", "79.00")),
            format!("GREY,3,fixed,a,800,{}", rest.replace("80.00", "78.00")),
            "GREY,3,fixed,none,800,800,,,,,,,,,,5.00,9.00,360,0,0,0.000200,0.000100,0.000200,0.000100,58.0,9000,3000"
                .to_owned(),
        ];
        let rows = map::read("m", &format!("{}{}\n", map::write(&[]), lines.join("\n"))).unwrap();
        let prices = Prices::read("p", prices).unwrap();
        let strides: Vec<u16> = front(&rows, &prices, Core::M0).iter().map(|(row, _)| row.front.stride.get()).collect();
        assert_eq!(strides, [3, 2, 1]);
    }
}
