//! The scripts of `samples/slurm` on a real Slurm of one node, which is started here and ended with the test.
//!
//! Skipped, with the reason printed, where Slurm or munge is not installed (Debian: `slurm-wlm`, `munge`) or this is not root.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::shards::Case;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// For what takes seconds.
const PATIENCE: Duration = Duration::from_mins(2);

/// A process that ends with the test.
struct Daemon(Child);

impl Drop for Daemon {
    fn drop(&mut self) {
        // Asked first: slurmd then ends what it started.
        let _ = Command::new("kill").arg(self.0.id().to_string()).status();
        let asked = Instant::now();
        while self.0.try_wait().is_ok_and(|ended| ended.is_none()) && asked.elapsed() < Duration::from_secs(10) {
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// munged, slurmctld, slurmd, and a folder for all that they write.
struct Slurm {
    /// In the order in which they end.
    _daemons: [Daemon; 3],
    folder: tempfile::TempDir,
}

impl Slurm {
    /// Starts them, or tells why not.
    fn start() -> Option<Self> {
        let Some([munged, slurmctld, slurmd, _]) = programs() else {
            println!("skipped: no Slurm here; on Debian install slurm-wlm and munge");
            return None;
        };
        let root = Command::new("id").arg("-u").output().unwrap().stdout == b"0\n";
        if !root {
            println!("skipped: a Slurm of one's own needs root");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let mode = |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
        mode(folder.path(), 0o755);
        for name in ["state", "spool"] {
            std::fs::create_dir(at(name)).unwrap();
        }
        // Nobody else is to be kept out: who can read the folder is on this machine.
        std::fs::write(at("munge.key"), [0x5a; 128]).unwrap();
        mode(&at("munge.key"), 0o400);
        std::fs::write(at("slurm.conf"), configuration(folder.path())).unwrap();
        let daemon = |program: &Path, words: &[String]| {
            let log = || std::fs::File::create(at(&format!("{}.out", program.file_name().unwrap().display()))).unwrap();
            let mut command = Command::new(program);
            command.args(words).env("SLURM_CONF", at("slurm.conf")).stdin(Stdio::null()).stdout(log()).stderr(log());
            Daemon(command.spawn().unwrap())
        };
        let munge = [
            "key-file=munge.key",
            "socket=munge.socket",
            "pid-file=munged.pid",
            "log-file=munged.log",
            "seed-file=munged.seed",
        ];
        let munge = munge.iter().map(|option| {
            let (option, file) = option.split_once('=').unwrap();
            format!("--{option}={}", at(file).display())
        });
        let munge: Vec<String> = ["--foreground".to_owned(), "--force".to_owned()].into_iter().chain(munge).collect();
        let munged = daemon(&munged, &munge);
        wait_for("munged", || at("munge.socket").exists());
        let slurmctld = daemon(&slurmctld, &["-D".to_owned(), "-i".to_owned()]);
        let slurmd = daemon(&slurmd, &["-D".to_owned()]);
        let slurm = Self { _daemons: [slurmd, slurmctld, munged], folder };
        let idle = || {
            let told = slurm.command("sinfo").args(["--noheader", "--format=%T"]).output().unwrap();
            told.stdout == b"idle\n"
        };
        wait_for("an idle node", idle);
        Some(slurm)
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.folder.path().join("slurm.conf")).current_dir(self.folder.path());
        command.env("MHP_INSPECTOR", env!("CARGO_BIN_EXE_mhp-inspector")).env("PATH", path());
        command
    }

    /// `sbatch` of one of the scripts.
    fn sbatch(&self, flags: &[&str], script: &str, words: &[&str], variables: &[(&str, &str)]) -> Output {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/slurm").join(script);
        let mut command = self.command("timeout");
        command.arg(PATIENCE.as_secs().to_string()).args(["sbatch", "--parsable"]).args(flags).arg(script).args(words);
        command.envs(variables.iter().copied()).output().unwrap()
    }

    /// Submits the array, and the merge that depends on it; whether that was done, and what it said.
    fn shards_and_merge(&self, array: &str, out: &str, words: &[&str], variables: &[(&str, &str)]) -> (bool, String) {
        let array = format!("--array={array}");
        let submitted = self.sbatch(&[&array], "shards.sh", &[&[out], words].concat(), variables);
        assert!(submitted.status.success(), "{}", String::from_utf8_lossy(&submitted.stderr));
        let dependency = format!("--dependency=afterany:{}", String::from_utf8(submitted.stdout).unwrap().trim());
        let merged = self.sbatch(&[&dependency], "merge.sh", &[out], &[]);
        assert!(merged.status.success(), "{}", String::from_utf8_lossy(&merged.stderr));
        let merge = String::from_utf8(merged.stdout).unwrap().trim().to_owned();
        let done = self.ended(&merge);
        let log = self.folder.path().join(format!("slurm-{merge}.out"));
        let told = std::fs::read_to_string(&log).unwrap_or_else(|_| self.logs());
        (done, told)
    }

    /// Waits for a job, and whether it ended with exit code 0. `sbatch --wait` asks every ten seconds.
    fn ended(&self, job: &str) -> bool {
        let state = || {
            let told = self.command("scontrol").args(["show", "job", job, "--oneliner"]).output().unwrap();
            String::from_utf8(told.stdout).unwrap()
        };
        let waits = ["PENDING", "CONFIGURING", "RUNNING", "COMPLETING"].map(|word| format!("JobState={word}"));
        wait_for("end of the merge", || {
            let told = state();
            told.contains("JobState=") && !waits.iter().any(|word| told.contains(word))
        });
        state().contains("JobState=COMPLETED")
    }

    /// What the daemons said, where something is wrong.
    fn logs(&self) -> String {
        let read = |name: &str| std::fs::read_to_string(self.folder.path().join(name)).unwrap_or_default();
        ["slurmctld.log", "slurmd.log", "munged.log"].map(read).concat()
    }
}

fn path() -> String {
    format!("{}:/usr/sbin:/sbin", std::env::var("PATH").unwrap_or_default())
}

/// The four programs that are needed.
fn programs() -> Option<[PathBuf; 4]> {
    let path = path();
    let find = |name: &str| std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file());
    Some([find("munged")?, find("slurmctld")?, find("slurmd")?, find("sbatch")?])
}

fn configuration(folder: &Path) -> String {
    let host = String::from_utf8(Command::new("hostname").arg("-s").output().unwrap().stdout).unwrap();
    let (host, folder) = (host.trim(), folder.display());
    // Both are held until both are known, so that they are two.
    let ports = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    let [ctld, slurmd] = ports.map(|port| port.local_addr().unwrap().port());
    format!(
        "ClusterName=test\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={ctld}\nSlurmdPort={slurmd}\n\
         AuthType=auth/munge\nAuthInfo=socket={folder}/munge.socket\nSlurmUser=root\nSlurmdUser=root\n\
         StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool\n\
         SlurmctldPidFile={folder}/slurmctld.pid\nSlurmdPidFile={folder}/slurmd.pid\n\
         SlurmctldLogFile={folder}/slurmctld.log\nSlurmdLogFile={folder}/slurmd.log\n\
         ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nSwitchType=switch/none\nMpiDefault=none\n\
         SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\nSlurmdParameters=config_overrides\n\
         ReturnToService=2\nMailProg=/bin/true\n\
         SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,bf_interval=1\n\
         NodeName={host} NodeAddr=127.0.0.1 CPUs=4 State=UNKNOWN\n\
         PartitionName=test Nodes={host} Default=YES MaxTime=INFINITE State=UP\n"
    )
}

fn wait_for(what: &str, there: impl Fn() -> bool) {
    let began = Instant::now();
    while !there() {
        assert!(began.elapsed() < PATIENCE, "no {what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn an_array_and_the_merge_that_waits_for_it_make_what_one_run_makes() {
    let Some(slurm) = Slurm::start() else { return };
    let case = Case::new();
    let data = case.at("data").display().to_string();
    let out = |name: &str| case.at(name).display().to_string();
    let fit = ["fit", &data, "--iterations", "2"];

    // An array that counts from 0. One frame cannot be read: its shard and the merge end with exit code 1, and are whole.
    case.ends(1, &[&fit[..], &["--out", "@one"]].concat());
    let (done, told) = slurm.shards_and_merge("0-2", &out("zero"), &fit, &[]);
    assert!(!done && told.contains("6 of 7 frames fitted"), "{told}{}", slurm.logs());
    case.same("one", "zero/whole");

    // One that counts from 1, where something keeps the second task from its folder: the merge names its shard.
    let count = ["count", &data];
    case.ends(1, &["count", "@data", "--csv", "@count.csv"]);
    std::fs::create_dir_all(case.at("one-based/shards")).unwrap();
    std::fs::write(case.at("one-based/shards/2"), "in the way").unwrap();
    let (done, told) = slurm.shards_and_merge("1-3", &out("one-based"), &count, &[]);
    assert!(!done && told.contains("shard 2/3 is missing") && told.contains("--shard 2/3"), "{told}{}", slurm.logs());
    assert!(!case.at("one-based/whole").exists());
    // That shard again, by itself.
    std::fs::remove_file(case.at("one-based/shards/2")).unwrap();
    let (_, told) = slurm.shards_and_merge("2", &out("one-based"), &count, &[("SHARD", "2/3")]);
    assert!(told.contains("could not be counted"), "{told}{}", slurm.logs());
    let bytes = |file: &str| std::fs::read(case.at(file)).unwrap();
    assert!(bytes("count.csv") == bytes("one-based/whole/count.csv"));
}
