//! Lists of visible instances: the rows of the whole crowd, in the list's order, on every device.

use tumble::crowd::{CrowdError, CrowdOutput, CrowdValues};

use super::{ALL, SOME, bits, cpu, crowds, evaluated, layer, library};
use crate::support::Random;

/// A list of some instances in any order.
pub(super) fn some(random: &mut Random, instances: usize, count: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..instances).collect();
    for index in 0..count {
        let other = index + random.next() as usize % (instances - index);
        all.swap(index, other);
    }
    all.truncate(count);
    all
}

/// Lists that grow, shrink and are removed, with changes between them: each row is that of the
/// whole crowd.
#[test]
fn visible_instances_have_the_rows_of_the_whole_crowd() {
    let mut random = Random(61);
    for (joints, instances, layers) in [(5, 150, 1), (17, 70, 3)] {
        let library = library(&mut random, joints, &SOME[..2]);
        let mut whole = cpu().crowd(&library, instances, layers).unwrap();
        let mut all = crowds(&library, instances, layers);
        for count in [3, 70, 0, 1, 41, instances, 33] {
            let list = some(&mut random, instances, count);
            let mut changes = Vec::new();
            for slot in 0..instances * layers {
                // First all layers change, then a few, of which few are visible.
                if count == 3 || random.next().is_multiple_of(9) {
                    let plays = layer(&mut random, &library);
                    changes.push((slot / layers, slot % layers, plays));
                }
            }
            whole.set_all(&changes).unwrap();
            whole.advance(0.4).unwrap();
            let expected = ALL.map(|values| bits(&evaluated(&mut whole, values)));
            for (name, crowd) in &mut all {
                crowd.set_all(&changes).unwrap();
                crowd.advance(0.4).unwrap();
                crowd.set_visible(&list).unwrap();
                assert!(crowd.visible().unwrap().eq(list.iter().copied()));
                for (values, expected) in ALL.into_iter().zip(&expected) {
                    let found = bits(&evaluated(crowd, values));
                    let each = joints * CrowdOutput::from(values).vector_count();
                    assert_eq!(found.len(), count * each);
                    for (row, &instance) in found.chunks_exact(each).zip(&list) {
                        let of_all = &expected[instance * each..][..each];
                        assert!(
                            row == of_all,
                            "{name}, {values:?}, instance {instance} of {count}"
                        );
                    }
                }
                let mut half = vec![[0; 4]; crowd.output_len(CrowdValues::Model)];
                crowd
                    .evaluate_half_into(CrowdValues::Model, &mut half)
                    .unwrap();
                // The instances that were not visible have continued.
                if count == 41 {
                    crowd.set_all_visible();
                    let mut half_of_all = vec![[0; 4]; crowd.output_len(CrowdValues::Model)];
                    let evaluated_half =
                        crowd.evaluate_half_into(CrowdValues::Model, &mut half_of_all);
                    evaluated_half.unwrap();
                    for (row, &instance) in half.chunks_exact(3 * joints).zip(&list) {
                        let first = 3 * joints * instance;
                        assert!(row == &half_of_all[first..first + 3 * joints], "{name}");
                    }
                    assert!(
                        bits(&evaluated(crowd, CrowdValues::Local)) == expected[1],
                        "{name}"
                    );
                }
            }
        }
    }
}

/// A submission keeps its size when another list is set before its result is read.
#[test]
fn a_submission_has_the_list_that_it_was_made_with() {
    let mut random = Random(67);
    let library = library(&mut random, 6, &SOME[..1]);
    for (name, mut crowd) in crowds(&library, 20, 1) {
        for instance in 0..20 {
            crowd
                .set(instance, 0, layer(&mut random, &library))
                .unwrap();
        }
        let whole = evaluated(&mut crowd, CrowdValues::Rotations);
        crowd.set_visible(&[7, 2]).unwrap();
        crowd.submit(CrowdValues::Rotations).unwrap();
        crowd.set_visible(&[11]).unwrap();
        let mut found = [[0.0; 4]; 12];
        let refused = crowd.wait_into(&mut found[..6]).unwrap_err();
        let sizes = CrowdError::OutputLength {
            length: 6,
            needed: 12,
        };
        assert_eq!(refused, sizes, "{name}");
        crowd.wait_into(&mut found).unwrap();
        let expected = [&whole[7 * 6..8 * 6], &whole[2 * 6..3 * 6]].concat();
        assert_eq!(bits(&found), bits(&expected), "{name}");
        let found = evaluated(&mut crowd, CrowdValues::Rotations);
        assert_eq!(bits(&found), bits(&whole[11 * 6..12 * 6]), "{name}");
        // Without visible instances the result is empty, at once.
        crowd.set_visible(&[]).unwrap();
        crowd.submit(CrowdOutput::half(CrowdValues::Local)).unwrap();
        assert!(crowd.poll().unwrap());
        crowd.wait_half_into(&mut []).unwrap();
    }
}

#[test]
fn lists_refuse_instances_that_are_not_there_or_come_twice() {
    let mut random = Random(71);
    let library = library(&mut random, 2, &SOME[..1]);
    let mut crowd = cpu().crowd(&library, 130, 2).unwrap();
    let list = [129, 0, 64];
    crowd.set_visible(&list).unwrap();
    for (wrong, expected) in [
        (
            vec![1, 130],
            CrowdError::Missing {
                subject: "instance",
                index: 130,
                count: 130,
            },
        ),
        (
            vec![1 << 32],
            CrowdError::Missing {
                subject: "instance",
                index: 1 << 32,
                count: 130,
            },
        ),
        (
            vec![5, 64, 5],
            CrowdError::Repeated {
                instance: 5,
                position: 2,
            },
        ),
        (
            vec![0; 200],
            CrowdError::Repeated {
                instance: 0,
                position: 1,
            },
        ),
    ] {
        assert_eq!(crowd.set_visible(&wrong).unwrap_err(), expected);
        assert!(crowd.visible().unwrap().eq(list.iter().copied()));
        assert_eq!(crowd.visible_count(), 3);
    }
    crowd.set_all_visible();
    assert!(crowd.visible().is_none() && crowd.visible_count() == 130);
}
