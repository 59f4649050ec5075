//! Which part of a surface's answer a light asks for, and whether it is weighed against what the surface would have drawn.

/// What a light asks of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum MisStrategy {
    /// What it sends back.
    Value,
    /// The same of a light without size, of which only some make highlights.
    Delta { shines: bool },
    /// What it sends back, and how densely it would have drawn a direction that the light drew with this density.
    Weighed(f64),
}

impl MisStrategy {
    /// Whether what is diffused alone answers it.
    pub fn is_dull(&self) -> bool {
        matches!(self, Self::Delta { shines: false })
    }
}

#[cfg(test)]
mod tests {
    use super::super::weight;
    use raywright_bvh::stability::judge::Random;

    /// Protects: the shares of two techniques are numbers from 0 to 1 that sum to one whatever their densities are, none, infinite or with squares that
    /// no f64 holds, and where f64 holds everything, those of the definition.
    #[test]
    fn m05_shares_of_extreme_densities() {
        let extremes = [0.0, 1e-300, 1e-30, 1.0, 1e25, 1e300, f64::INFINITY];
        for (own, other) in extremes.into_iter().flat_map(|own| extremes.map(|other| (own, other))) {
            let shares = [weight(own, other), weight(other, own)];
            assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{own:e}, {other:e}: {shares:?}");
            assert!((shares[0] + shares[1] - 1.0).abs() <= 2.0 * f64::EPSILON, "{own:e}, {other:e}: {shares:?}");
        }
        for index in 0..10_000 {
            let random = &mut Random::new(1, index);
            let exponent = random.between(-140.0, 140.0);
            let (own, other) = (10_f64.powf(exponent), 10_f64.powf(exponent + random.between(-10.0, 10.0)));
            // The one square that might be lost is lost beside the other.
            let wanted = own * own / (own * own + other * other);
            assert!((weight(own, other) - wanted).abs() <= 1e-14 * wanted, "{:016x}, {:016x}", own.to_bits(), other.to_bits());
        }
    }
}
