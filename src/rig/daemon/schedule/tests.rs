#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use proptest::prelude::*;

use super::*;

fn with_queue(objects: &[&str]) -> Schedule {
    let mut schedule = Schedule::default();
    for object in objects {
        schedule.enqueue((*object).to_owned()).unwrap();
    }
    schedule
}

fn capture(object: &str) -> Next {
    Next::Job(Job::Capture {
        object: object.to_owned(),
        meter: false,
    })
}

#[test]
fn a_removal_while_the_head_is_captured_takes_out_what_it_names_and_the_success_nothing_else() {
    let mut schedule = with_queue(&["mug", "cow", "bust"]);
    schedule.submit_next(None).unwrap();
    schedule.dequeue(0, Some("mug")).unwrap();
    assert_eq!(schedule.begin(), capture("mug"));
    schedule.finish(true);
    assert_eq!(schedule.queue(), ["cow", "bust"]);
}

#[test]
fn an_object_stays_at_the_head_until_a_capture_of_it_succeeds() {
    let mut schedule = with_queue(&["mug", "cow"]);
    for succeeded in [false, true] {
        schedule.submit_next(None).unwrap();
        assert_eq!(schedule.begin(), capture("mug"));
        assert_eq!(schedule.queue(), ["mug", "cow"]);
        schedule.finish(succeeded);
    }
    assert_eq!(schedule.queue(), ["cow"]);
}

#[test]
fn a_command_for_another_object_than_stands_there_is_refused() {
    let mut schedule = with_queue(&["mug", "cow"]);
    for refused in [
        schedule.dequeue(1, Some("mug")),
        schedule.submit_next(Some("cow")),
    ] {
        let refused = refused.unwrap_err();
        assert!(
            matches!(&refused, Refused::Busy(why) if why.contains("has changed")),
            "{refused}"
        );
    }
    assert_eq!(schedule.queue(), ["mug", "cow"]);
}

#[test]
fn a_stop_of_a_job_that_ends_by_itself_does_not_reach_the_next_one() {
    let mut schedule = Schedule::default();
    schedule.submit(Job::Home).unwrap();
    schedule.begin();
    assert_eq!(schedule.stop(), StopTarget::Running);
    schedule.finish(true);
    schedule.submit(Job::Jog(90.0)).unwrap();
    assert_eq!(schedule.begin(), Next::Job(Job::Jog(90.0)));
}

#[test]
fn a_stopped_job_that_has_not_begun_gives_way_to_stopping_the_table() {
    let mut schedule = with_queue(&["mug"]);
    schedule.submit_next(None).unwrap();
    assert_eq!(schedule.stop(), StopTarget::Settled);
    assert_eq!(schedule.begin(), Next::Job(Job::StopTable));
    assert_eq!(schedule.stop(), StopTarget::Settled);
    schedule.finish(true);
    assert_eq!(schedule.queue(), ["mug"]);
    assert_eq!(schedule.begin(), Next::Idle);
}

#[test]
fn the_queue_is_bounded() {
    let mut schedule = Schedule::default();
    let taken = (0..200).filter(|n| schedule.enqueue(n.to_string()).is_ok());
    assert_eq!(taken.count(), LONGEST_QUEUE);
}

/// What people and the worker do, in any order.
#[derive(Debug, Clone)]
enum Step {
    Enqueue,
    Dequeue(usize),
    DequeueNamed(usize, usize),
    Next,
    NextNamed(usize),
    Start,
    Stop,
    End,
    Begin,
    Finish(bool),
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        4 => Just(Step::Enqueue),
        2 => (0..4_usize).prop_map(Step::Dequeue),
        2 => (0..4_usize, 0..6_usize).prop_map(|(place, name)| Step::DequeueNamed(place, name)),
        4 => Just(Step::Next),
        1 => (0..6_usize).prop_map(Step::NextNamed),
        2 => Just(Step::Start),
        3 => Just(Step::Stop),
        1 => Just(Step::End),
        6 => Just(Step::Begin),
        6 => any::<bool>().prop_map(Step::Finish),
    ]
}

/// What was promised to the people: objects that wait, in order, and what the worker is at.
#[derive(Debug, Default)]
struct Promises {
    waiting: Vec<String>,
    enqueued: usize,
    /// The job that was accepted and has not begun.
    accepted: Option<(Job, Option<String>)>,
    /// The job under way, and the object of the queue that it captures.
    running: Option<(Job, Option<String>)>,
    is_ending: bool,
}

impl Promises {
    fn name(&self, number: usize) -> String {
        format!("object {}", self.enqueued.saturating_sub(number))
    }

    fn takes_jobs(&self) -> bool {
        !self.is_ending && self.accepted.is_none() && self.running.is_none()
    }

    fn accept_next(&mut self, result: Result<(), Refused>, expected: Option<&str>) {
        let head = self.waiting.first().cloned();
        let fits = head.is_some() && expected.is_none_or(|name| head.as_deref() == Some(name));
        assert_eq!(result.is_ok(), fits && self.takes_jobs());
        if result.is_ok() {
            let object = head.unwrap();
            let meter = false;
            let capture = Job::Capture {
                object: object.clone(),
                meter,
            };
            self.accepted = Some((capture, Some(object)));
        }
    }

    fn dequeued(&mut self, result: Result<(), Refused>, place: usize, expected: Option<&str>) {
        let object = self.waiting.get(place);
        let fits = object.is_some_and(|object| expected.is_none_or(|name| name == object));
        assert_eq!(result.is_ok(), fits);
        if fits {
            self.waiting.remove(place);
        }
    }
}

fn apply(schedule: &mut Schedule, promises: &mut Promises, step: &Step) {
    match step {
        Step::Enqueue => {
            promises.enqueued += 1;
            let object = promises.name(0);
            schedule.enqueue(object.clone()).unwrap();
            promises.waiting.push(object);
        }
        Step::Dequeue(place) => {
            let result = schedule.dequeue(*place, None);
            promises.dequeued(result, *place, None);
        }
        Step::DequeueNamed(place, name) => {
            let name = promises.name(*name);
            let result = schedule.dequeue(*place, Some(&name));
            promises.dequeued(result, *place, Some(&name));
        }
        Step::Next => {
            let result = schedule.submit_next(None);
            promises.accept_next(result, None);
        }
        Step::NextNamed(name) => {
            let name = promises.name(*name);
            let result = schedule.submit_next(Some(&name));
            promises.accept_next(result, Some(&name));
        }
        Step::Start => {
            let accepted = schedule.submit(Job::Home).is_ok();
            assert_eq!(accepted, promises.takes_jobs());
            if accepted {
                promises.accepted = Some((Job::Home, None));
            }
        }
        Step::Stop => stop(schedule, promises),
        Step::End => {
            schedule.end();
            promises.is_ending = true;
        }
        Step::Begin => begin(schedule, promises),
        // A worker reports what it began, and nothing else.
        Step::Finish(succeeded) if promises.running.is_some() => {
            schedule.finish(*succeeded);
            let (_, object) = promises.running.take().unwrap();
            if let Some(object) = object.filter(|_| *succeeded) {
                promises.waiting.retain(|waiting| *waiting != object);
            }
        }
        Step::Finish(_) => {}
    }
}

/// A stop always reaches something: the job under way, or a table that is to stand.
fn stop(schedule: &mut Schedule, promises: &mut Promises) {
    let target = schedule.stop();
    match &promises.running {
        _ if promises.is_ending => assert_eq!(target, StopTarget::Settled),
        Some((Job::StopTable, _)) => assert_eq!(target, StopTarget::Settled),
        Some(_) => assert_eq!(target, StopTarget::Running),
        None => {
            assert_eq!(target, StopTarget::Settled);
            promises.accepted = Some((Job::StopTable, None));
        }
    }
}

/// What begins is what was accepted last and was not stopped; one at a time; none after the end.
fn begin(schedule: &mut Schedule, promises: &mut Promises) {
    let next = schedule.begin();
    if promises.is_ending {
        assert_eq!(next, Next::End);
    } else if promises.running.is_some() {
        assert_eq!(next, Next::Idle);
    } else {
        promises.running = promises.accepted.take();
        let job = promises.running.as_ref().map(|(job, _)| job.clone());
        assert_eq!(next, job.map_or(Next::Idle, Next::Job));
    }
}

proptest! {
    #[test]
    fn in_any_order_no_object_is_lost_and_no_stop_goes_astray(
        steps in prop::collection::vec(step(), 0..80)
    ) {
        let mut schedule = Schedule::default();
        let mut promises = Promises::default();
        for step in &steps {
            apply(&mut schedule, &mut promises, step);
            prop_assert_eq!(schedule.queue(), promises.waiting.clone());
            let is_free = promises.accepted.is_none() && promises.running.is_none();
            prop_assert_eq!(schedule.is_free(), is_free);
        }
    }
}
