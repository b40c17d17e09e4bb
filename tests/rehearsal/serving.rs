//! `relit-capture serve` as the program that a service manager starts.

use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::support::{SHORT, fixture};

const TOKEN: &str = "0123456789abcdef";
/// Longest wait for anything; all that is waited for comes far sooner.
const LONG: Duration = Duration::from_secs(300);

/// The program, with a token in a file of these permissions.
fn serve(root: &Path, mode: u32) -> Command {
    let token = root.join("token");
    fs::write(&token, format!("{TOKEN}\n")).unwrap();
    fs::set_permissions(&token, Permissions::from_mode(mode)).unwrap();
    let mut command = Command::new(relit_tests::program("relit-capture"));
    command
        .args(["serve", "--json", "--turntable", "none", "--listen"])
        .args(["127.0.0.1:0", "--camera"])
        .arg(format!("replay:{}?loop=1", fixture(SHORT).display()))
        .arg("--root")
        .arg(root.join("sessions"))
        .arg("--token-file")
        .arg(token)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// The status with which a request for the state is answered.
fn status(address: &str, header: &str) -> String {
    let mut socket = TcpStream::connect(address).unwrap();
    socket.set_read_timeout(Some(LONG)).unwrap();
    let head = format!("GET /api/v1/state HTTP/1.1\r\nHost: {address}\r\n{header}");
    let head = head + "Connection: close\r\n\r\n";
    socket.write_all(head.as_bytes()).unwrap();
    let mut line = String::new();
    BufReader::new(socket).read_line(&mut line).unwrap();
    line.split(' ').nth(1).unwrap().to_owned()
}

/// Ends the program with the test, however that ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_service_reports_its_start_and_end_and_lets_in_who_has_the_files_token() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("notify");
    let manager = UnixDatagram::bind(&path).unwrap();
    manager.set_read_timeout(Some(LONG)).unwrap();
    let hear = || {
        let mut buffer = [0; 512];
        let count = manager.recv(&mut buffer).unwrap();
        String::from_utf8(buffer[..count].to_vec()).unwrap()
    };
    let mut command = serve(root.path(), 0o600);
    command.env("NOTIFY_SOCKET", &path);
    let mut running = Running(command.spawn().unwrap());
    let ready = hear();
    assert!(
        ready.starts_with("READY=1\nSTATUS=Serving on 127.0.0.1:"),
        "{ready}"
    );

    let mut line = String::new();
    let output = running.0.stdout.take().unwrap();
    BufReader::new(output).read_line(&mut line).unwrap();
    let serving: Value = serde_json::from_str(&line).unwrap();
    let address = serving["address"].as_str().unwrap();
    assert_eq!(status(address, ""), "401");
    let bearer = format!("Authorization: Bearer {TOKEN}\r\n");
    assert_eq!(status(address, &bearer), "200");

    kill_process(Pid::from_child(&running.0), Signal::TERM).unwrap();
    assert_eq!(hear(), "STOPPING=1\n");
    assert!(running.0.wait().unwrap().success());
}

#[test]
fn a_tokens_file_that_others_can_read_is_refused_with_the_way_out() {
    let root = tempfile::tempdir().unwrap();
    let mut running = Running(serve(root.path(), 0o644).spawn().unwrap());
    assert_eq!(running.0.wait().unwrap().code(), Some(1));
    let mut said = String::new();
    let mut output = running.0.stderr.take().unwrap();
    output.read_to_string(&mut said).unwrap();
    assert!(said.contains("644") && said.contains("chmod 600"), "{said}");
}

#[test]
fn a_tokens_file_is_made_at_the_first_start() {
    let root = tempfile::tempdir().unwrap();
    let mut command = serve(root.path(), 0o600);
    let file = root.path().join("token");
    fs::remove_file(&file).unwrap();
    let mut running = Running(command.spawn().unwrap());
    let mut line = String::new();
    let output = running.0.stdout.take().unwrap();
    BufReader::new(output).read_line(&mut line).unwrap();
    let serving: Value = serde_json::from_str(&line).unwrap();
    let token = fs::read_to_string(&file).unwrap();
    assert_eq!(token.trim().len(), 32, "{token}");
    assert!(serving["url"].as_str().unwrap().ends_with(token.trim()));
    let mode = fs::metadata(&file).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode, 0o600);
}
