//! Summary of all findings: each cause once, worst first, with the pixels at which cameras see it.

use super::*;
use crate::fault::Scope;

/// Greatest number of findings that are kept for each pair of severity and kind.
const KEPT: usize = 16;
/// Share of a ray's length before its end within which a surface counts as the end.
const NEAR: f64 = 1e-4;

impl SceneFacts<'_> {
    /// Returns the summary: each cause once, worst first. Without a prepared scene, no pixel is set.
    pub fn summarise(&self, ready: Option<&ReadyScene>, mut findings: Vec<Fault>) -> StressSummary {
        if self.objects.is_empty() {
            findings.push(NothingSeen.fault(Subject::Scene,
                "the scene has no object: the file has no object, or all its objects were left out when it was read",
                "check the warnings about the file, and whether the file has a mesh with finite vertices",
            ));
        }
        let mut findings = self.merge(self.without_consequences(findings));
        findings.sort_by(|a, b| {
            let key = |f: &Fault| (f.severity, f.kind, f.subject);
            (key(a), &a.message).cmp(&(key(b), &b.message))
        });
        let (all, mut of_kind) = (findings.len(), BTreeMap::new());
        findings.retain(|finding| {
            let kept = of_kind.entry((finding.severity, finding.kind)).or_insert(0);
            *kept += 1;
            *kept <= KEPT
        });
        if let Some(ready) = ready {
            self.assign_pixels(ready, &mut findings);
        }
        StressSummary {
            left_out: all - findings.len(),
            findings,
            checks: Vec::new(),
            cameras: [self.views.len(), self.scene.cameras.len().max(1)],
            size: self.views.first().map_or([1, 1], |view| view.size),
            solid: SolidSummary::from_topologies(self.scene, &self.topologies),
        }
    }

    /// Removes the findings that follow from other findings of the list, so that each cause is
    /// reported once.
    fn without_consequences(&self, mut findings: Vec<Fault>) -> Vec<Fault> {
        for &cause in FaultKind::ALL {
            for (scope, codes) in cause.explains() {
                let causes = findings.iter().filter(|finding| finding.kind == cause);
                let causes: Vec<(Subject, Severity)> = causes
                    .flat_map(|finding| {
                        let subjects = finding.others.iter().chain([&finding.subject]);
                        subjects.map(|&subject| (subject, finding.severity))
                    })
                    .collect();
                findings.retain(|finding| {
                    let is_explained = |&(subject, severity): &(Subject, Severity)| {
                        // What is harmless makes nothing else wrong.
                        let is_as_severe = severity <= finding.severity;
                        match scope {
                            Scope::Scene => is_as_severe,
                            Scope::Subject => is_as_severe && subject == finding.subject,
                            Scope::Image => self.reads_image(finding.subject, subject),
                        }
                    };
                    !(codes.contains(&finding.kind) && causes.iter().any(is_explained))
                });
            }
        }
        findings
    }

    /// Returns whether a material reads an image. For any other `reader`, returns whether the sky or
    /// any material in use reads it.
    fn reads_image(&self, reader: Subject, image: Subject) -> bool {
        let is_it = |name: &str| {
            let index = self.lookup.images.index_of(name);
            index.map(Subject::Image) == Some(image)
        };
        let is_read = |material: &Material| {
            let mut textures = material
                .textures()
                .filter_map(|reference| self.lookup.texture(&reference.name));
            textures.any(|texture| is_it(&texture.image))
        };
        match reader {
            Subject::Material(index) => is_read(&self.scene.materials[index]),
            _ => {
                matches!(&self.scene.sky, Some(Sky::Map(map)) if is_it(&map.image))
                    || self.used_materials().into_values().any(is_read)
            }
        }
    }

    /// Merges findings that agree in severity, kind, reason, remedy and kind of subject. The subject
    /// whose position is nearest to a camera becomes the main subject.
    fn merge(&self, findings: Vec<Fault>) -> Vec<Fault> {
        let mut groups: HashMap<_, Vec<Fault>> = HashMap::new();
        for finding in findings {
            let subject = core::mem::discriminant(&finding.subject);
            let words = (finding.message.clone(), finding.remedy.clone());
            let key = (finding.severity, finding.kind, subject, words);
            groups.entry(key).or_default().push(finding);
        }
        let distance = |finding: &Fault| {
            let key = finding
                .place
                .map(|place| self.view_distance_key(place.into()));
            key.unwrap_or((2, 0.0))
        };
        let merge = |mut group: Vec<Fault>| {
            group.sort_by_key(|finding| finding.subject);
            // Of several cameras.
            group.dedup_by_key(|finding| finding.subject);
            let [count, of] =
                [|f: &Fault| f.count, |f: &Fault| f.of].map(|of| group.iter().map(of).sum());
            let order = |a: &usize, b: &usize| {
                let [a, b] = [a, b].map(|index| distance(&group[*index]));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            };
            let nearest = (0..group.len()).min_by(order).unwrap_or(0);
            let mut main = group.remove(nearest);
            main.others
                .extend(group.iter().map(|finding| finding.subject));
            main.others.sort_unstable();
            Fault { count, of, ..main }
        };
        groups.into_values().map(merge).collect()
    }

    /// Sets the pixel of each finding: that of the first camera that sees its position. A hit
    /// anywhere on the object of a finding without a primitive counts as seen.
    fn assign_pixels(&self, ready: &ReadyScene, findings: &mut [Fault]) {
        let open = findings
            .iter_mut()
            .filter(|finding| finding.pixel.is_none());
        for finding in open {
            let Some(place) = finding.place else { continue };
            let seen = self.views.iter().find_map(|view| {
                let pixel = view.project_point(place.into())?;
                let ray = view.ray_through_pixel(pixel);
                let end = (DVec3::from(place) - ray.origin).dot(ray.direction) * (1.0 - NEAR);
                let hits = self.trace(ready, vec![ray]).remove(0);
                let is_own = |object: usize| {
                    finding.primitive.is_none() && finding.subject == Subject::Object(object)
                };
                let is_end = |hit: &super::facts::RayHit| hit.distance >= end || is_own(hit.object);
                let is_seen = hits.iter().any(is_end)
                    || hits
                        .last()
                        .is_none_or(|hit| !self.objects[hit.object].is_opaque());
                is_seen.then_some((pixel, view.index))
            });
            finding.pixel = seen;
        }
    }
}
