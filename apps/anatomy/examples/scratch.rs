use stylet_anatomy::*;
use stylet_mesh::generate::{contours::*, implicit::Implicit};
fn main() {
    let bytes = std::fs::read("apps/anatomy/data/synthetic.dcm").unwrap();
    let whole = rt::read(&bytes).unwrap();
    let mut ok = vec![];
    for cut in 0..bytes.len() {
        if let Ok(s) = rt::read(&bytes[..cut]) {
            ok.push((cut, s == whole, s.drawings.len(), s.drawings.last().map(|d| d.contours.len())));
        }
    }
    println!("{} cuts read; len {}; {:?}", ok.len(), bytes.len(), ok.iter().filter(|o| !o.1).collect::<Vec<_>>());
    let rss = || {
        std::fs::read_to_string("/proc/self/status")
            .unwrap()
            .lines()
            .find(|l| l.starts_with("VmHWM"))
            .unwrap()
            .to_string()
    };
    println!("{}", rss());
    let t = std::time::Instant::now();
    let mut slow = vec![];
    for at in 0..3000 {
        for b in [0xff, 0x7f] {
            let mut c = bytes.clone();
            c[at] = b;
            let t = std::time::Instant::now();
            let _ = rt::read(&c);
            let s = t.elapsed().as_secs_f64();
            if s > 0.05 {
                slow.push((at, b, s));
            }
        }
    }
    println!("{:?} {:?} {}", t.elapsed(), slow, rss());
    // speed
    let (set, _) = whole.check(&ContourSettings::default()).unwrap();
    for organ in set.organs() {
        let t = std::time::Instant::now();
        let solid = ContourSolid::new(organ);
        let build = t.elapsed();
        let [low, high] = solid.bounds().unwrap();
        for (name, grow) in [("box", 0.0), ("twice the box", 0.5)] {
            let n = 100;
            let t = std::time::Instant::now();
            let mut sum = 0.0;
            for i in 0..n * n * n {
                let at = [i % n, i / n % n, i / n / n];
                let p = std::array::from_fn(|k| {
                    let e = high[k] - low[k];
                    low[k] - grow * e + (1.0 + 2.0 * grow) * e * at[k] as f64 / n as f64
                });
                sum += solid.distance(&p);
            }
            println!(
                "{} {name}: build {build:?}, {:.0} ns/call ({sum})",
                organ.name(),
                t.elapsed().as_secs_f64() * 1e9 / 1e6
            );
        }
    }
}
