//! How much the facets of a layered surface reflect: a dielectric and a metal in shares, by Schlick's formula or the exact ones, with a thin
//! film over them or not.

use super::film::Film;
use super::fresnel::{conductor, dielectric_in_air, towards_grazing};
use crate::number::{Number, Vector3};

/// Reflectance by the cosine of incidence on a facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflectance<N: Number> {
    /// Of the dielectric part at normal and at grazing incidence, in its share.
    pub dielectric: [N::Vec3; 2],
    /// The index by which it goes from one to the other, where that is not Schlick's way.
    pub exact: Option<N::Exact>,
    /// Of the metal in its share.
    pub metal: [N::Vec3; 2],
    /// Complex index of the metal, n and k, and its share, in place of the above.
    pub conductor: Option<([N::Vec3; 2], N)>,
    /// A film over both.
    pub film: Option<Film<N>>,
}

impl<N: Number> Reflectance<N> {
    /// At normal incidence, without a film.
    pub fn bare(&self) -> N::Vec3 {
        self.dielectric[0] + self.metal[0]
    }

    /// At a cosine of incidence.
    pub fn at(&self, cosine: N) -> N::Vec3 {
        let cosine = cosine.max(N::ZERO).min(N::ONE);
        let schlick = towards_grazing(cosine);
        let rise = self.exact.map_or(schlick, |ior| {
            N::of_lanes(|lane| {
                let ior = N::exact_lane(ior, lane);
                let f0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
                (dielectric_in_air(cosine.lane(lane), ior) - f0) / (1.0 - f0)
            })
        });
        let between = |[normal, grazing]: [N::Vec3; 2], rise: N| normal + (grazing - normal) * rise;
        let metal = match self.conductor {
            None => between(self.metal, schlick),
            Some(([n, k], share)) => {
                let exact = <N::Vec3 as Vector3<N>>::of_lanes(|lane| {
                    let (n, k) = (n.lane(lane), k.lane(lane));
                    let of = |n: f64, k: f64| conductor(cosine.lane(lane), [n, k]);
                    glam::DVec3::new(of(n.x, k.x), of(n.y, k.y), of(n.z, k.z))
                });
                exact * share
            }
        };
        let whole = between(self.dielectric, rise) + metal;
        self.film.map_or(whole, |film| film.over(whole, self.bare(), cosine))
    }

    /// Whether some of it reflects somewhere.
    pub fn is_some(&self) -> bool {
        use crate::number::Mask;
        let [[a, b], [c, d]] = [self.dielectric, self.metal];
        a.max(b).max(c).max(d).max_element().above(N::ZERO).any()
    }
}
