use std::time::Instant;
use glam::*;
use tumble::*;
fn main() {
    let mut set = TrackSet::new();
    let mut s = 12345u64;
    let mut r = move || { s ^= s << 13; s ^= s >> 7; s ^= s << 17; (s >> 11) as f64 / (1u64<<53) as f64 };
    for _ in 0..4096 {
        let mut t = 0.0; let mut q = DQuat::IDENTITY; let (mut ts, mut ks) = (vec![], vec![]);
        for i in 0..26 { ts.push(if i == 25 {20.0} else {t}); ks.push(Quat::from_array(q.to_array().map(|c| c as f32)));
          t += 0.8*(0.5+0.98*r()); t = t.min(19.0 + i as f64*0.01);
          let ax = DVec3::new(r()-0.5, r()-0.5, r()-0.5).normalize(); q = (q*DQuat::from_axis_angle(ax, 1.2*r())).normalize(); }
        set.push("", &ts, &ks).unwrap();
    }
    let frames = Frames::fps(60).between(0.0, 19.99);
    let mut out: Vec<Quat> = vec![Quat::IDENTITY; 4096*1200];
    let mut w: Vec<[f32;4]> = vec![[0.0;4]; 4096*1200];
    let time = |f: &mut dyn FnMut()| { let mut v: Vec<f64> = (0..9).map(|_| { let t = Instant::now(); f(); t.elapsed().as_secs_f64()*1e3 }).collect(); v.sort_by(f64::total_cmp); v[4] };
    use rayon::prelude::*;
    let wr = time(&mut || w.par_chunks_mut(16384).for_each(|c| c.fill([1.0,2.0,3.0,4.0])));
    println!("write {wr:.2} ms = {:.0} M/s", 4.9152/wr*1e3);
    for method in METHODS {
        for width in VectorWidth::available() { for threads in [1usize, 2] {
        let mut o = EngineOptions::default(); o.vector_width = Some(width); o.threads = Some(threads);
        let e = Engine::with_options(Device::Cpu, &o).unwrap();
        let c = e.upload(&set, method).unwrap();
        let n = c.timeline(&frames).unwrap().len()*4096;
        let ms = time(&mut || c.evaluate_into(&frames, Layout::TrackMajor, &mut out[..n]).unwrap());
        println!("{method} {width:?} {threads}: {ms:.2} ms, {:.0} M/s", n as f64/ms/1e3); }}
        let e = Engine::new(Device::Cpu).unwrap();
        let p = time(&mut || { let _ = e.upload(&set, method).unwrap(); });
        println!("   prepare {p:.2} ms");
        for d in Device::list().unwrap() {
          let e = Engine::new(d).unwrap(); let c = e.upload(&set, method).unwrap();
          let n = c.timeline(&frames).unwrap().len()*4096;
          let ms = time(&mut || { let r = c.evaluate(&frames).unwrap(); std::hint::black_box(&r); });
          println!("{method} {}: {ms:.2} ms, {:.0} M/s", e.device_name(), n as f64/ms/1e3);
        }
    }
}
