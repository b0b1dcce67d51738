//! Resampling of weighted particles.
//!
//! Source: Kitagawa 1996 for systematic resampling.

/// As many indices as there are weights, each as often as its weight says (systematic resampling); `offset` is
/// between zero and one.
pub fn systematic(weights: &[f64], offset: f64) -> Vec<usize> {
    let (n, mut parent, mut up_to) = (weights.len() as f64, 0, weights[0]);
    let pick = |index: usize| {
        while up_to * n < index as f64 + offset && parent + 1 < weights.len() {
            parent += 1;
            up_to += weights[parent];
        }
        parent
    };
    (0..weights.len()).map(pick).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_taken_as_often_as_its_weight_says() {
        assert_eq!(systematic(&[0.5, 0.25, 0.0, 0.25], 0.5), [0, 0, 1, 3]);
        assert_eq!(systematic(&[0.1, 0.9], 0.1), [0, 1]);
        assert_eq!(systematic(&[0.1, 0.9], 0.9), [1, 1]);
    }
}
