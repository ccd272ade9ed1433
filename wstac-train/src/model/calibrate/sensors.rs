//! What a sensor adds to the samples of all textures.

use super::{LabeledSamples, lda};

/// Estimates of textures and sensors by turns. They differ little after the second.
const TURNS: usize = 3;
/// The fewest slides of a sensor that tell what it adds: of fewer, much would be what differs between slides.
const FEWEST_SLIDES: usize = 10;

/// Takes from each sample what its sensor adds to those of all textures: a sample is the sum of what its texture gives,
/// of what its sensor adds, and of what differs between slides, by least squares.
///
/// `sensors` has the number of each sample's sensor.
pub(super) fn remove(samples: &mut LabeledSamples, sensors: &[usize]) {
    let LabeledSamples { numbers, labels, .. } = samples;
    let labels: Vec<usize> = labels.iter().map(|&label| label.into()).collect();
    let inputs = numbers.first().map_or(0, Vec::len);
    let number = |groups: &[usize]| groups.iter().max().map_or(0, |most| most + 1);
    // The mean of each group's samples, less those of other groups.
    let means = |groups: &[usize], less: &[Vec<f64>], others: &[usize]| {
        let samples = numbers.iter().zip(others).map(|(sample, &other)| {
            let less = &less[other];
            sample.iter().zip(less).map(|(&x, less)| f64::from(x) - less)
        });
        lda::means(samples.zip(groups.iter().copied()), number(groups), inputs)
    };
    let (mut added, mut counts) = (vec![vec![0.0; inputs]; number(sensors)], Vec::new());
    for _ in 0..TURNS {
        let (textures, _) = means(&labels, &added, sensors);
        (added, counts) = means(sensors, &textures, &labels);
    }
    for (sample, &sensor) in numbers.iter_mut().zip(sensors).filter(|(_, sensor)| counts[**sensor] >= FEWEST_SLIDES) {
        for (x, added) in sample.iter_mut().zip(&added[sensor]) {
            // A conversion of a real number saturates.
            *x = (f64::from(*x) - added).round() as i16;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns slides of textures and sensors, and each one's sensor: not every texture is on every sensor.
    fn slides(number: usize) -> (LabeledSamples, Vec<usize>) {
        let (mut samples, mut sensors) = (LabeledSamples::default(), Vec::new());
        for k in 0..number {
            let (texture, sensor) = ((k / 9) % 6, k % 9);
            if (texture + sensor) % 4 != 0 {
                let added = [300, -200, 0][sensor % 3];
                samples.numbers.push(vec![100 * texture as i16 + added, 7]);
                samples.labels.push(texture as u16);
                sensors.push(sensor);
            }
        }
        (samples, sensors)
    }

    #[test]
    fn what_sensors_add_is_gone_and_textures_stay() {
        let (mut samples, sensors) = slides(54 * 4);
        remove(&mut samples, &sensors);
        let of = |texture: u16| samples.numbers.iter().zip(&samples.labels).filter(move |(_, one)| **one == texture);
        let mean = |texture| of(texture).map(|(x, _)| f64::from(x[0])).sum::<f64>() / of(texture).count() as f64;
        for texture in 0..6 {
            let (least, most) = (of(texture).map(|(x, _)| x[0]).min(), of(texture).map(|(x, _)| x[0]).max());
            assert!(most.unwrap() - least.unwrap() <= 12, "texture {texture}: {least:?} to {most:?}");
            assert!(of(texture).all(|(x, _)| x[1] == 7));
            assert!(texture == 0 || (mean(texture) - mean(texture - 1) - 100.0).abs() < 12.0, "texture {texture}");
        }
    }

    #[test]
    fn sensors_with_few_slides_stay() {
        let (mut samples, sensors) = slides(54);
        let before = samples.clone();
        remove(&mut samples, &sensors);
        assert_eq!(samples, before);
    }
}
