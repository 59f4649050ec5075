//! Summary of all findings: each cause once, worst first, with the pixels at which cameras see it.

use super::finding::Scope;
use super::*;

/// Greatest number of findings that are kept for each pair of severity and code.
const KEPT: usize = 16;
/// Share of a ray's length before its end within which a surface counts as the end.
const NEAR: f64 = 1e-4;

impl SceneFacts<'_> {
    /// Returns the summary: each cause once, worst first. Without a prepared scene, no pixel is set.
    pub fn summarise(
        &self,
        ready: Option<&ReadyScene>,
        mut findings: Vec<StressFinding>,
    ) -> StressSummary {
        if self.objects.is_empty() {
            findings.push(FindingCode::NothingSeen.finding(
                PictureWrong,
                FindingSubject::Scene,
                "the scene has no object: the file has no object, or all its objects were left out when it was read",
                "check the warnings about the file, and whether the file has a mesh with finite vertices",
            ));
        }
        let mut findings = self.merge(self.without_consequences(findings));
        findings.sort_by(|a, b| {
            let key = |f: &StressFinding| (f.severity, f.code, f.subject);
            (key(a), &a.reason).cmp(&(key(b), &b.reason))
        });
        let (all, mut of_kind) = (findings.len(), BTreeMap::new());
        findings.retain(|finding| {
            let kept = of_kind.entry((finding.severity, finding.code)).or_insert(0);
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
        }
    }

    /// Removes the findings that follow from other findings of the list, so that each cause is
    /// reported once.
    fn without_consequences(&self, mut findings: Vec<StressFinding>) -> Vec<StressFinding> {
        for &cause in FindingCode::ALL {
            for (scope, codes) in cause.explains() {
                let causes = findings.iter().filter(|finding| finding.code == cause);
                let causes: Vec<(FindingSubject, Severity)> = causes
                    .flat_map(|finding| {
                        let subjects = finding.others.iter().chain([&finding.subject]);
                        subjects.map(|&subject| (subject, finding.severity))
                    })
                    .collect();
                findings.retain(|finding| {
                    let is_explained = |&(subject, severity): &(FindingSubject, Severity)| {
                        // What is harmless makes nothing else wrong.
                        let is_as_severe = severity <= finding.severity;
                        match scope {
                            Scope::Scene => is_as_severe,
                            Scope::Subject => is_as_severe && subject == finding.subject,
                            Scope::Image => self.reads_image(finding.subject, subject),
                        }
                    };
                    !(codes.contains(&finding.code) && causes.iter().any(is_explained))
                });
            }
        }
        findings
    }

    /// Returns whether a material reads an image. For any other `reader`, returns whether the sky or
    /// any material in use reads it.
    fn reads_image(&self, reader: FindingSubject, image: FindingSubject) -> bool {
        let is_it = |name: &str| {
            let index = self.lookup.images.index_of(name);
            index.map(FindingSubject::Image) == Some(image)
        };
        let is_read = |material: &Material| {
            let mut textures = material
                .textures()
                .filter_map(|reference| self.lookup.texture(&reference.name));
            textures.any(|texture| is_it(&texture.image))
        };
        match reader {
            FindingSubject::Material(index) => is_read(&self.scene.materials[index]),
            _ => {
                matches!(&self.scene.sky, Some(Sky::Map(map)) if is_it(&map.image))
                    || self.used_materials().into_values().any(is_read)
            }
        }
    }

    /// Merges findings that agree in severity, code, reason, remedy and kind of subject. The subject
    /// whose position is nearest to a camera becomes the main subject.
    fn merge(&self, mut findings: Vec<StressFinding>) -> Vec<StressFinding> {
        findings.sort_by(|a, b| {
            let key = |f: &StressFinding| (f.severity, f.code);
            (key(a), &a.reason, &a.remedy, a.subject).cmp(&(
                key(b),
                &b.reason,
                &b.remedy,
                b.subject,
            ))
        });
        let kind = |finding: &StressFinding| core::mem::discriminant(&finding.subject);
        let mut groups: Vec<StressFinding> = Vec::new();
        for mut finding in findings {
            let is_one = |last: &&mut StressFinding| {
                (last.severity, last.code, kind(last))
                    == (finding.severity, finding.code, kind(&finding))
                    && (&last.reason, &last.remedy) == (&finding.reason, &finding.remedy)
            };
            let Some(last) = groups.last_mut().filter(is_one) else {
                groups.push(finding);
                continue;
            };
            // Of several cameras.
            if last.subject == finding.subject || last.others.last() == Some(&finding.subject) {
                continue;
            }
            let distance = |finding: &StressFinding| {
                let place = finding
                    .place
                    .map(|place| self.view_distance_key(place.into()));
                place.unwrap_or((2, 0.0))
            };
            (last.count, last.of) = (last.count + finding.count, last.of + finding.of);
            if distance(&finding) < distance(last) {
                (finding.count, finding.of) = (last.count, last.of);
                core::mem::swap(last, &mut finding);
                last.others = core::mem::take(&mut finding.others);
            }
            last.others.push(finding.subject);
        }
        groups
            .iter_mut()
            .for_each(|group| group.others.sort_unstable());
        groups
    }

    /// Sets the pixel of each finding: that of the first camera that sees its position. A hit
    /// anywhere on the object of a finding without a primitive counts as seen.
    fn assign_pixels(&self, ready: &ReadyScene, findings: &mut [StressFinding]) {
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
                    finding.primitive.is_none() && finding.subject == FindingSubject::Object(object)
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
