//! A video of a turn that needs no camera: an object that stands still before a background that moves, in a light that
//! changes.

/// The source of such a video, for FFmpeg's `lavfi`: so many frames of this size, with this hue in degrees. `object` is
/// FFmpeg's condition for a pixel (X, Y) that is the object's.
pub fn turning(size: [u32; 2], rate: u32, frames: u32, hue: u32, object: &str) -> String {
    let [width, height] = size;
    let seconds = f64::from(frames) / f64::from(rate);
    let still = 2 * frames;
    format!(
        "testsrc2=size={width}x{height}:rate={rate}:duration={seconds},hue=h={hue},split[a][b];\
         [a]scroll=h=0.13:v=0.07[background];\
         [b]trim=end_frame=1,loop={still}:1:0,setpts=N/{rate}/TB,format=yuva444p,\
         geq=lum='lum(X,Y)':cb='cb(X,Y)':cr='cr(X,Y)':a='255*{object}'[object];\
         [background][object]overlay=shortest=1,eq=brightness='0.1*sin(5*t)+0.03*t':eval=frame"
    )
}
