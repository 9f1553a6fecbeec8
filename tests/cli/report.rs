//! The page `report.html`: what is in it, when it is written, and `skep view`.

use super::{command, failure, path, skep, small_board, text};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use tempfile::TempDir;

/// The limit that the page keeps to.
const MOST_BYTES: u64 = 25_000_000;
/// A view's name that would end elements and start others where it is not escaped.
const HOSTILE: &str = "a<b>\"'&<script>alert(1)<!--.jpg";

/// The small board, whose first view has the hostile name.
fn hostile_board() -> TempDir {
    let folder = small_board();
    let images = folder.path().join("images");
    fs::rename(images.join("key.jpg"), images.join(HOSTILE)).unwrap();
    let list = folder.path().join("sparse/images.txt");
    fs::write(&list, fs::read_to_string(&list).unwrap().replace("key.jpg", HOSTILE)).unwrap();
    folder
}

fn reconstruct(scene: &TempDir, output: &Path, more: &[&str]) {
    let output = output.to_str().unwrap();
    let fixed = ["reconstruct", path(scene), "--preset", "fast", "--quiet", "--output", output];
    let done = skep(&[&fixed[..], more].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
}

/// The page, and the figures in it.
fn page(output: &Path) -> (String, Value) {
    let page = fs::read_to_string(output.join("report.html")).unwrap();
    let (_, rest) = page.split_once("id=\"data\">").unwrap();
    let (figures, _) = rest.split_once("</script>").unwrap();
    let figures = serde_json::from_str(figures).unwrap();
    (page, figures)
}

/// `skep view`, where no program of a desktop opens the page.
fn view(output: &Path, more: &[&str]) -> std::process::Output {
    let mut command = command(&[&["view", output.to_str().unwrap()], more].concat());
    command.env("PATH", "").output().unwrap()
}

#[test]
fn a_run_writes_one_page_without_references_and_with_names_escaped() {
    let (scene, output) = (hostile_board(), TempDir::new().unwrap());
    reconstruct(&scene, output.path(), &[]);
    let (page, figures) = page(output.path());
    assert!((page.len() as u64) < MOST_BYTES, "{} bytes", page.len());
    assert!(!page.contains(HOSTILE) && !page.contains("<b>\"'&"), "the name is in it as it is");
    let names = |value: &Value| value["name"].as_str().map(str::to_owned);
    assert!(figures["views"].as_array().unwrap().iter().any(|view| names(view).as_deref() == Some(HOSTILE)));
    let (markup, _) = page.rsplit_once("<script>").unwrap();
    for reference in ["src=", "<link", "@import", "url(", "href=\"http"] {
        assert!(!markup.contains(reference), "{reference}");
    }
    assert!(page.contains("default-src 'none'"), "the browser loads nothing");

    assert_eq!(figures["complete"], true);
    for layer in ["photograph", "depth", "normal", "sources", "confidence", "status"] {
        assert!(page.contains(&format!("id=\"view-6-{layer}\"")), "{layer}");
    }
    let report = &figures["report"];
    assert!(report["totals"]["wall_seconds"].as_f64().unwrap() > 0.0, "with the times");
    assert_eq!(report["totals"]["points"], figures["cloud"]["of"]);
    let is_share = |cycle: &Value| cycle["median_residual"].as_f64().is_some();
    assert!(report["views"][0]["cycles"].as_array().unwrap().iter().all(is_share));

    // Another run in the folder replaces it, and none remains where it is not wanted.
    reconstruct(&scene, output.path(), &["--seed", "5", "--write", "-report"]);
    assert!(!output.path().join("report.html").exists());
    assert!(output.path().join("stereo/status_maps").is_dir(), "only the page is left out");
    let made = view(output.path(), &[]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    assert!(text(&made.stdout).contains("report.html"), "{}", text(&made.stdout));
    assert!(text(&made.stderr).contains("open the file in a browser"), "{}", text(&made.stderr));
    assert_eq!(self::page(output.path()).1["report"]["options"]["seed"], 5);
}

#[test]
fn what_is_not_there_is_missing_in_the_page() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    reconstruct(&scene, output.path(), &["--write", "depth,report", "--cloud-format", "laz"]);
    let (page, figures) = page(output.path());
    assert!(page.contains("id=\"view-0-depth\"") && !page.contains("id=\"view-0-normal\""));
    assert!(figures["cloud"]["points"].as_u64().unwrap() > 1000, "LAZ is read");
    assert_eq!(figures["cloud"]["has_confidence"], false);
}

#[test]
fn a_run_that_is_not_complete_shows_what_is_done() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    let fixed = ["--preset", "fast", "--quiet", "--output", path(&output)];
    assert!(skep(&[&["plan", path(&scene)], &fixed[..]].concat()).status.success());
    let tasks = ["search", "check"];
    assert!(tasks.iter().all(|task| skep(&[task, path(&output), "--cycle", "0", "-q"]).status.success()));
    let made = view(output.path(), &[]);
    assert!(text(&made.stderr).contains("not complete"), "{}", text(&made.stderr));
    let (_, figures) = page(output.path());
    assert_eq!((&figures["complete"], &figures["finished"]), (&false.into(), &0.into()));
    assert_eq!(figures["report"]["totals"]["cycles"].as_array().unwrap().len(), 1);

    // The end of the run replaces it, and its times are not known.
    reconstruct(&scene, output.path(), &[]);
    assert_eq!(page(output.path()).1["complete"], true);

    for (folder, problem) in [("no such folder", "no such file or folder"), (path(&scene), "no run here")] {
        let (status, printed) = failure(&["view", folder]);
        assert!(status == Some(2) && printed.contains(problem), "{printed}");
    }
}

/// A server that ends with the test.
struct Server(Child, String);

impl Server {
    fn start(output: &Path) -> Server {
        let mut command = command(&["view", output.to_str().unwrap(), "--serve", "0"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").and_then(|rest| rest.strip_suffix('/'));
        let address = address.unwrap_or_else(|| panic!("{line}")).to_owned();
        Server(child, address)
    }

    /// The answer to a request, as far as the first bytes tell.
    fn ask(&self, request: &str, host: &str) -> String {
        let mut stream = TcpStream::connect(&self.1).unwrap();
        write!(stream, "{request} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.take(1000).read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.0.kill().and_then(|()| self.0.wait()).unwrap();
    }
}

#[test]
fn the_page_is_served_to_this_machine_alone() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    reconstruct(&scene, output.path(), &[]);
    let server = Server::start(output.path());
    let own = server.1.clone();
    assert!(own.starts_with("127.0.0.1:"), "{own}");
    let answer = server.ask("GET /", &own);
    assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("<!doctype html>"), "{answer}");
    assert!(server.ask("GET /", "localhost").starts_with("HTTP/1.1 403"), "without the port");
    let foreign = server.ask("GET /", &own.replace("127.0.0.1", "example.org"));
    assert!(foreign.starts_with("HTTP/1.1 403"), "{foreign}");
    assert!(server.ask("POST /", &own).starts_with("HTTP/1.1 405"));
    assert!(server.ask("GET /report.json", &own).starts_with("HTTP/1.1 404"));
}
