//! All backends on some rays, and the judge on what they disagree about.

use super::findings::{Checked, Class, Counts, KEPT, Unexplained};
use super::judge::{Judge, Truth};
use super::queries::{Answer, Answers, GROUP, Query, Subject, packets};
use crate::accel::Coherence;
use crate::scene::{Hit, Ray};

/// Of the rays that all agree about, one in so many is judged nevertheless.
const AUDIT: usize = 16;

/// Distances that differ by less are equal without a judge: two roundings.
const NEGLIGIBLE: f32 = 2.0 * f32::EPSILON;

/// An answer that differs from the reference's.
struct Disagreement {
    /// Which ray of the group.
    ray: usize,
    subject: usize,
    query: Query,
    /// `None` where a lane answered that was switched off.
    answer: Option<Answer>,
}

/// Traces some rays with all subjects and judges what they disagree about.
pub fn check_rays(judge: &Judge, subjects: &[Subject], rays: &[Ray]) -> Checked {
    let counts = vec![Counts::default(); subjects.len()];
    let mut checked = Checked { rays: rays.len() as u64, counts, ..Checked::default() };
    for (number, rays) in rays.chunks(GROUP).enumerate() {
        check_group(judge, subjects, number, rays, &mut checked);
    }
    checked
}

fn check_group(judge: &Judge, subjects: &[Subject], group: usize, rays: &[Ray], checked: &mut Checked) {
    let mut reference: Vec<Option<Hit>> = Vec::new();
    let mut disagreements = Vec::new();
    for (subject, Subject { accel, .. }) in subjects.iter().enumerate() {
        for query in Query::all() {
            let Answers { answers, strays } = accel.trace(query, group, rays);
            if reference.is_empty() {
                // The first subject's closest hits of single rays.
                reference = answers.iter().map(Answer::closest).collect();
            }
            for (ray, (answer, reference)) in answers.iter().zip(&reference).enumerate() {
                if !equal(answer, reference.as_ref()) {
                    disagreements.push(Disagreement { ray, subject, query, answer: Some(*answer) });
                }
            }
            let strays = strays.into_iter();
            disagreements.extend(strays.map(|ray| Disagreement { ray, subject, query, answer: None }));
        }
    }
    // Stable, so that the subjects stay in order.
    disagreements.sort_by_key(|found| found.ray);

    let mut left = disagreements.as_slice();
    let mut classes = vec![Class::Agree; subjects.len()];
    // Whether one of the subject's closest hits that differ is in order.
    let mut named = vec![false; subjects.len()];
    // Answers about the same ray that are classed already; most queries answer the same.
    let mut judged: Vec<(Answer, Option<Class>)> = Vec::new();
    for (index, (ray, reference)) in rays.iter().zip(&reference).enumerate() {
        let (found, others) = left.split_at(left.partition_point(|found| found.ray == index));
        left = others;
        if found.is_empty() && index % AUDIT != 0 {
            checked.counts.iter_mut().for_each(|counts| counts.add(Class::Agree));
            continue;
        }
        checked.audited += u64::from(found.is_empty());
        let truth = judge.truth(ray);
        classes.fill(Class::Agree);
        named.fill(false);
        judged.clear();
        let mut complain = |subject: usize, query: Query, answer: Option<Answer>| {
            if checked.unexplained.len() < KEPT {
                let (start, packet, _) = packets(query.width, group, rays)
                    .find(|(start, packet, _)| (*start..*start + packet.len()).contains(&index))
                    .unwrap_or((0, rays, Coherence::Coherent));
                checked.unexplained.push(Unexplained {
                    backend: subjects[subject].name.to_owned(),
                    query,
                    answer,
                    reference: *reference,
                    truth,
                    ray: *ray,
                    packet: packet.to_vec(),
                    lane: index - start,
                });
            }
        };
        if !judge.admits_closest(ray, &truth, reference.as_ref()) {
            classes[0] = Class::Unexplained;
            let query = Query { occlusion: false, width: 1 };
            complain(0, query, Some(Answer::Closest(*reference)));
        }
        for Disagreement { subject, query, answer, .. } in found {
            let class = answer.and_then(|answer| {
                if let Some((_, class)) = judged.iter().find(|(known, _)| *known == answer) {
                    return *class;
                }
                let class = admits(judge, ray, &truth, &answer)
                    .then(|| explained(judge, ray, &answer, reference.as_ref(), &mut checked.worst));
                judged.push((answer, class));
                class
            });
            // The closest hits, which came first, name the triangle in the way. If the truth knows of nothing
            // there, it is seen edge-on from afar.
            named[*subject] |= class.is_some() && matches!(answer, Some(Answer::Closest(Some(_))));
            let edge_on = *answer == Some(Answer::Occluded(true)) && named[*subject];
            let class = class.or(edge_on.then_some(Class::InPlane));
            // One failed query of a subject is reported.
            if class.is_none() && classes[*subject] != Class::Unexplained {
                complain(*subject, *query, *answer);
            }
            classes[*subject] = classes[*subject].max(class.unwrap_or(Class::Unexplained));
        }
        checked.counts.iter_mut().zip(&classes).for_each(|(counts, class)| counts.add(*class));
    }
}

/// Whether an answer is the reference's, within the rounding of single precision.
fn equal(answer: &Answer, reference: Option<&Hit>) -> bool {
    match (answer, reference) {
        (Answer::Closest(Some(a)), Some(b)) => {
            let same = (a.instance, a.triangle) == (b.instance, b.triangle);
            same && (a.t - b.t).abs() <= NEGLIGIBLE * a.t.abs()
        }
        (answer, reference) => answer.is_hit() == reference.is_some(),
    }
}

fn admits(judge: &Judge, ray: &Ray, truth: &Truth, answer: &Answer) -> bool {
    match answer {
        Answer::Closest(hit) => judge.admits_closest(ray, truth, hit.as_ref()),
        Answer::Occluded(occluded) => Judge::admits_occlusion(truth, *occluded),
    }
}

/// What kind of difference it is that has an explanation.
fn explained(judge: &Judge, ray: &Ray, answer: &Answer, reference: Option<&Hit>, worst: &mut f64) -> Class {
    let candidate = |hit: &Hit| judge.test(ray, hit.instance, hit.triangle);
    let Answer::Closest(Some(a)) = answer else { return Class::Graze };
    let Some(first) = candidate(a) else { return Class::Graze };
    if !first.is_near(f64::from(a.t)) {
        return Class::InPlane;
    }
    let Some((b, second)) = reference.and_then(|b| Some((b, candidate(b)?))) else { return Class::Graze };
    if !second.is_near(f64::from(b.t)) {
        return Class::InPlane;
    }
    if (a.instance, a.triangle) == (b.instance, b.triangle) {
        let off = (f64::from(a.t) - first.t).abs().max((f64::from(b.t) - first.t).abs());
        if !first.in_plane {
            *worst = worst.max(off / first.error);
        }
        return Class::Agree;
    }
    if (first.t - second.t).abs() <= first.error + second.error { Class::Tie } else { Class::Graze }
}
