//! What a sensor adds to the samples of all textures.

use super::LabeledSamples;

/// Estimates of textures and sensors by turns. They differ little after the second.
const TURNS: usize = 3;

/// Takes from each sample what its sensor adds to those of all textures: a sample is the sum of what its texture gives,
/// of what its sensor adds, and of what differs between slides, by least squares.
///
/// `sensors` has the number of each sample's sensor.
pub(super) fn remove(samples: &mut LabeledSamples, sensors: &[usize]) {
    let LabeledSamples { numbers, labels, .. } = samples;
    let labels: Vec<usize> = labels.iter().map(|&label| label.into()).collect();
    let inputs = numbers.first().map_or(0, Vec::len);
    let mut added = vec![vec![0.0; inputs]; sensors.iter().max().map_or(0, |most| most + 1)];
    for _ in 0..TURNS {
        let textures = means(numbers, &labels, &added, sensors);
        added = means(numbers, sensors, &textures, &labels);
    }
    for (sample, &sensor) in numbers.iter_mut().zip(sensors) {
        for (x, added) in sample.iter_mut().zip(&added[sensor]) {
            // A conversion of a real number saturates.
            *x = (f64::from(*x) - added).round() as i16;
        }
    }
}

/// Returns the mean of each group's samples, less those of other groups.
fn means(numbers: &[Vec<i16>], groups: &[usize], less: &[Vec<f64>], others: &[usize]) -> Vec<Vec<f64>> {
    let inputs = numbers.first().map_or(0, Vec::len);
    let mut sums = vec![(vec![0.0; inputs], 0_usize); groups.iter().max().map_or(0, |most| most + 1)];
    for ((sample, &group), &other) in numbers.iter().zip(groups).zip(others) {
        let (sum, count) = &mut sums[group];
        *count += 1;
        for ((sum, &x), less) in sum.iter_mut().zip(sample).zip(&less[other]) {
            *sum += f64::from(x) - less;
        }
    }
    let mean = |(sum, count): (Vec<f64>, usize)| sum.into_iter().map(|sum| sum / count.max(1) as f64).collect();
    sums.into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_sensors_add_is_gone_and_textures_stay() {
        let mut samples = LabeledSamples::default();
        let mut sensors = Vec::new();
        // Not every texture is on every sensor.
        for (texture, sensor) in (0..6_u16).flat_map(|texture| (0..9).map(move |sensor| (texture, sensor))) {
            if (usize::from(texture) + sensor) % 4 == 0 {
                continue;
            }
            let added = [300, -200, 0][sensor % 3];
            samples.numbers.push(vec![100 * texture as i16 + added, 7]);
            samples.labels.push(texture);
            sensors.push(sensor);
        }
        remove(&mut samples, &sensors);
        let of =
            |texture: u16| samples.numbers.iter().zip(&samples.labels).filter(move |(_, label)| **label == texture);
        for texture in 0..6 {
            let (least, most) =
                (of(texture).map(|(x, _)| x[0]).min().unwrap(), of(texture).map(|(x, _)| x[0]).max().unwrap());
            assert!(most - least <= 12, "texture {texture}: {least} to {most}");
            assert!(of(texture).all(|(x, _)| x[1] == 7));
        }
        let mean = |texture| of(texture).map(|(x, _)| f64::from(x[0])).sum::<f64>() / of(texture).count() as f64;
        for texture in 1..6 {
            assert!((mean(texture) - mean(texture - 1) - 100.0).abs() < 12.0, "texture {texture}");
        }
    }
}
