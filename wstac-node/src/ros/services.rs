//! The services of the node, which nodes of ROS 2 call, and any program that speaks Zenoh.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use wstac_host::error::{Error, ErrorKind};
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::cdr::Cdr;
use super::names::{Type, attached, attachment};
use super::parameters::{Changes, Parameters};
use super::publishers::RosPublisher;
use super::requests::action;
use crate::arguments::Arguments;
use crate::note;
use crate::orders::{Action, Control};
use crate::queue::Queue;
use crate::refused::{in_words, refused};

/// The requests that wait at most. Further ones have no answer.
const MOST_WAITING: usize = 64;
/// The refusals and changes of parameters that wait at most.
pub(crate) const MOST_PATIENT: usize = 512;
/// The longest request, with all that comes along.
const MOST_BYTES: usize = 1 << 16;

/// A service of the node or of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Service {
    RestartBaseline,
    LoadConfig,
    LoadModel,
    StartRecording,
    StopRecording,
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
}

impl Service {
    /// The last part of each name: first those of sensors, then those of the node.
    const ALL: [(Self, &str); 11] = [
        (Self::RestartBaseline, "restart_baseline"),
        (Self::LoadConfig, "load_configuration"),
        (Self::LoadModel, "load_model"),
        (Self::StartRecording, "start_recording"),
        (Self::StopRecording, "stop_recording"),
        (Self::DescribeParameters, "describe_parameters"),
        (Self::GetParameters, "get_parameters"),
        (Self::GetParameterTypes, "get_parameter_types"),
        (Self::ListParameters, "list_parameters"),
        (Self::SetParameters, "set_parameters"),
        (Self::SetParametersAtomically, "set_parameters_atomically"),
    ];
    const OF_SENSORS: usize = 5;
}

/// The services, while they can be called.
pub(crate) struct Services {
    /// The services that are declared, which end with this.
    declared: Vec<(Queryable<()>, LivelinessToken)>,
    own: Sender<Work>,
}

/// Answers the requests, in a thread of its own. It never waits: an answer that a client does not take is dropped.
pub(crate) struct Clerk {
    parameters: Parameters,
    patient: Queue<Patient>,
    folder: Option<PathBuf>,
    arriving: Receiver<Work>,
    own: Sender<Work>,
}

enum Work {
    /// A request to a service, of the sensor with this place.
    Asked(Service, usize, PendingRequest),
    /// The result of what the sensor with this place was asked for.
    Done(Service, usize, PendingRequest, Result<String, Error>),
    /// The services are gone.
    Over,
}

/// A thing to send to those for whom it waits until they have taken it or are cut off.
enum Patient {
    /// A request that no service takes, and why.
    Refused(&'static str, Query),
    /// Parameters that have changed, as the message of their topic.
    Changed(Vec<u8>),
}

/// A request that has no answer yet.
struct PendingRequest {
    query: Query,
    /// The key of the service.
    key: Arc<str>,
    /// The count of the request as one that waits, until it is answered or given up.
    _waits: Waits,
}

/// One of the requests that wait.
struct Waits(Arc<AtomicUsize>);

impl Drop for Waits {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Services {
    /// Declares the services of the node and its sensors, and the topic of its parameters' changes. `first` is the number of
    /// the first one among all entities.
    ///
    /// # Errors
    /// The network refuses a key.
    pub(crate) fn new(
        session: &Session,
        arguments: &Arguments,
        controls: &[Control],
        first: usize,
    ) -> Result<(Self, Clerk), Error> {
        let (own, arriving) = channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let node = &arguments.node_name;
        let (of_sensor, of_node) = Service::ALL.split_at(Service::OF_SENSORS);
        let under = |services: &[(Service, &str)], place: usize, prefix: &str| -> Vec<_> {
            services.iter().map(|(of, last)| (*of, place, format!("{prefix}/{last}"))).collect()
        };
        let of_sensors = controls
            .iter()
            .enumerate()
            .flat_map(|(place, control)| under(of_sensor, place, &format!("{}/{}", arguments.namespace, control.name)));
        let refused = |error: zenoh::Error| refused(ErrorKind::Usage, "the services", &error);
        let events = RosPublisher::new(session, arguments, Type::ParameterEvent, "", first).map_err(refused)?;
        let (patient, work) = Queue::new(MOST_PATIENT);
        // It ends with the services and the clerk.
        let wait = move || waiting_thread(&work, events);
        thread::Builder::new().name("patient".into()).spawn(wait).map_err(|error| Error::io("a thread", error))?;
        let id = session.zid().to_string();
        let declare = |(number, (service, place, name)): (usize, (Service, usize, String))| {
            let (own, patient, waiting) = (own.clone(), patient.clone(), Arc::clone(&waiting));
            let key: Arc<str> = service.key(arguments.domain, &name).into();
            let answered = Arc::clone(&key);
            let take = move |mut query: Query| {
                if let Some(why) = refusal(&mut query, &answered) {
                    // Too many of them have no answer.
                    patient.add(Patient::Refused(why, query));
                } else if waiting.fetch_add(1, Ordering::Relaxed) < MOST_WAITING {
                    let request =
                        PendingRequest { query, key: Arc::clone(&answered), _waits: Waits(Arc::clone(&waiting)) };
                    // The clerk is gone only at the end.
                    let _ = own.send(Work::Asked(service, place, request));
                } else {
                    waiting.fetch_sub(1, Ordering::Relaxed);
                }
            };
            // Nodes of ROS 2 ask those alone that answer every request under their key.
            let queryable = session.declare_queryable(&*key).complete(true).callback(take).wait()?;
            let token = service.token(arguments.domain, &id, first + 1 + number, node, &name);
            Ok((queryable, session.liveliness().declare_token(token).wait()?))
        };
        let declared: zenoh::Result<_> =
            under(of_node, 0, node).into_iter().chain(of_sensors).enumerate().map(declare).collect();
        let parameters = Parameters {
            node: format!("/{node}"),
            namespace: arguments.namespace.clone(),
            domain: arguments.domain,
            controls: controls.to_vec(),
        };
        let folder = arguments.files.clone();
        let clerk = Clerk { parameters, patient: patient.clone(), folder, arriving, own: own.clone() };
        Ok((Self { declared: declared.map_err(refused)?, own }, clerk))
    }
}

/// Returns why no service takes a request with this key; `None` if one does. What waits for its refusal is short.
fn refusal(query: &mut Query, key: &str) -> Option<&'static str> {
    let length = |part: Option<&ZBytes>| part.map_or(0, ZBytes::len);
    let parameters = query.parameters().as_str().len();
    let why = if query.key_expr().as_str() != key {
        // It is meant for whatever has such a key. A service changes things, so it is called by its name.
        "the key has wildcards, expected that of one service"
    } else if length(query.payload()) + length(query.attachment()) + parameters > MOST_BYTES {
        "the request is too long"
    } else {
        return None;
    };
    if let Some(payload) = query.payload_mut() {
        *payload = ZBytes::new();
    }
    if let Some(attachment) = query.attachment_mut() {
        *attachment = ZBytes::new();
    }
    Some(why)
}

impl Drop for Services {
    fn drop(&mut self) {
        // Requests from now on find no service, and those before them are answered.
        self.declared.clear();
        // The clerk may be gone.
        let _ = self.own.send(Work::Over);
    }
}

/// Sends what may wait for those who get it.
fn waiting_thread(work: &Receiver<Patient>, mut events: RosPublisher) {
    for work in work {
        let sent = match work {
            // Whoever has asked may be gone.
            Patient::Refused(why, query) => query.reply_err(why).wait().or(Ok(())),
            Patient::Changed(message) => events.put(message),
        };
        if let Err(error) = sent {
            let error: zenoh::Error = error;
            note(format_args!("a change of parameters was not published: {}", in_words(&error.to_string())));
        }
    }
}

impl Clerk {
    /// Answers until the services are gone.
    pub(crate) fn run(mut self) {
        while let Ok(work) = self.arriving.recv() {
            match work {
                Work::Asked(service, place, request) => self.asked(service, place, request),
                Work::Done(service, place, request, result) => self.done(service, place, &request, result),
                Work::Over => break,
            }
        }
    }

    /// Answers with what a sensor has done, and publishes the parameter that has changed with it.
    fn done(&mut self, service: Service, place: usize, request: &PendingRequest, result: Result<String, Error>) {
        let is_done = result.is_ok();
        request.answer(&answer(service, result));
        let last = match service {
            Service::LoadConfig => "configuration",
            Service::LoadModel => "models",
            _ => return,
        };
        if let Some(control) = self.parameters.controls.get(place).filter(|_| is_done) {
            let changed = self.parameters.changed(control, last);
            self.publish(&changed);
        }
    }

    fn publish(&mut self, changed: &Changes) {
        // Whoever does not keep up with as many misses some.
        self.patient.add(Patient::Changed(self.parameters.event(changed)));
    }

    /// Answers a request about parameters, and hands any other one to its sensor.
    fn asked(&mut self, service: Service, place: usize, request: PendingRequest) {
        let payload = request.query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
        let mut changed = Vec::new();
        let of_node = match service {
            Service::DescribeParameters => self.parameters.describe(&payload),
            Service::GetParameters => self.parameters.get_all(&payload),
            Service::GetParameterTypes => self.parameters.types(&payload),
            Service::ListParameters => self.parameters.list(&payload),
            Service::SetParameters => self.parameters.set_all(&payload, &mut changed),
            Service::SetParametersAtomically => self.parameters.set_atomically(&payload, &mut changed),
            of_sensor => {
                match action(of_sensor, self.folder.as_deref(), &payload) {
                    Some(Ok(action)) => self.order(of_sensor, place, action, request),
                    Some(Err(error)) => request.answer(&answer(of_sensor, Err(error))),
                    None => request.refuse("the request is no message of the service"),
                }
                return;
            }
        };
        match of_node {
            Some(cdr) => request.answer(&cdr.finish()),
            None => request.refuse("the request is no message of the service, or names too many parameters"),
        }
        for changes in changed {
            self.publish(&changes);
        }
    }

    fn order(&self, service: Service, place: usize, action: Action, request: PendingRequest) {
        let Some(control) = self.parameters.controls.get(place) else { return };
        let back = self.own.clone();
        let answer = move |result| {
            // The clerk may be gone, and with it who would answer.
            let _ = back.send(Work::Done(service, place, request, result));
        };
        control.order(action, Box::new(answer));
    }
}

impl PendingRequest {
    /// Sends an answer. Whoever has asked may be gone.
    fn answer(&self, payload: &[u8]) {
        // Programs that are no nodes of ROS 2 need no attachment.
        let attached = self.query.attachment().and_then(|bytes| attached(&bytes.to_bytes()));
        let (number, client) = attached.unwrap_or_default();
        let reply = self.query.reply(&*self.key, payload);
        let _ = reply.attachment(attachment(number, client)).wait();
    }

    fn refuse(&self, why: &str) {
        let _ = self.query.reply_err(why).wait();
    }
}

/// Returns the text about an error for whoever has asked. What is wrong within a file is said here alone: it may quote the
/// file, which others cannot read.
fn said(service: Service, error: &Error) -> String {
    let is_of_file = matches!(service, Service::LoadConfig | Service::LoadModel);
    let is_safe = matches!(error.kind(), ErrorKind::Usage | ErrorKind::NotFound | ErrorKind::Io | ErrorKind::Busy);
    if !is_of_file || is_safe {
        return error.to_string();
    }
    note(error);
    format!("{}: cannot be used; the output of wstac-node says why", error.subject())
}

/// Returns the message that answers a request to a sensor.
fn answer(service: Service, result: Result<String, Error>) -> Vec<u8> {
    let is_done = result.is_ok();
    let text = result.unwrap_or_else(|error| said(service, &error));
    let cdr = Cdr::new().bool(is_done);
    match service {
        // The text of a recording that has started is its file.
        Service::StartRecording if is_done => cdr.text("leave the sensor untouched for 25 frames").text(&text),
        Service::StartRecording => cdr.text(&text).text(""),
        _ => cdr.text(&text),
    }
    .finish()
}
