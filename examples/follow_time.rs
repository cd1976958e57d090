use glam::Vec3;
use tumble::*;
fn main() {
    let mut set = TrackSet::new();
    let mut seed = 1u64;
    let mut unit = || {
        seed = seed
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (seed >> 40) as f32 / (1u64 << 24) as f32
    };
    let tracks: usize = std::env::args().nth(1).map_or(2000, |t| t.parse().unwrap());
    for _ in 0..tracks {
        let mut place = Vec3::ZERO;
        let mut way = Vec3::X;
        let keys: Vec<Vec3> = (0..11)
            .map(|_| {
                way = (way + Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5)).normalize();
                place += way;
                place
            })
            .collect();
        let times: Vec<f64> = (0..11).map(f64::from).collect();
        set.push_path("", &times, &keys, &[]).unwrap();
    }
    let mut options = EngineOptions::default();
    options.threads = Some(1.try_into().unwrap());
    let engine = Engine::with_options(Device::Cpu, &options).unwrap();
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .ok();
    for (name, follow) in [
        ("minimal", Follow::default()),
        (
            "fixed",
            Follow {
                frame: Frame::Fixed,
                ..Follow::default()
            },
        ),
        (
            "frenet",
            Follow {
                frame: Frame::Frenet,
                ..Follow::default()
            },
        ),
        (
            "constant",
            Follow {
                speed: PathSpeed::Constant,
                ..Follow::default()
            },
        ),
    ] {
        for rate in [1, 60] {
            let mut best = f64::INFINITY;
            for _ in 0..3 {
                let t = std::time::Instant::now();
                let f = engine
                    .follow(&set, &follow, &Frames::fps(rate), Layout::TrackMajor)
                    .unwrap();
                std::hint::black_box(&f);
                best = best.min(t.elapsed().as_secs_f64());
            }
            println!(
                "{name} {rate} fps: {:.3} ms, {:.3} us an interval",
                best * 1e3,
                best * 1e6 / (tracks * 10) as f64
            );
        }
    }
    let n = 1_000_000;
    let v: Vec<Vec3> = (0..n).map(|_| Vec3::new(unit(), unit(), unit())).collect();
    for k in ["linear", "gaussian:2"] {
        let vectors = Vectors::of(&v, 1, Layout::TrackMajor).unwrap();
        let t = std::time::Instant::now();
        let f = engine
            .smooth_vectors(&vectors, &Smoothing::new(k.parse().unwrap()))
            .unwrap();
        std::hint::black_box(&f);
        println!(
            "smooth {k} 1M vectors: {:.2} ms",
            t.elapsed().as_secs_f64() * 1e3
        );
    }
}
