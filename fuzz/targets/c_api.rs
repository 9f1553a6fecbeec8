//! The C ABI as a host in C calls it: buffers are exactly as large as the arguments say, and end at a page
//! that cannot be touched. Any call may be refused; none may panic.
#![allow(unsafe_code)] // Pointers for C.

use super::{new_folder, write};
use std::ffi::{CStr, CString, c_char, c_void};
use std::os::unix::ffi::OsStrExt;
use std::ptr::{null, null_mut};
use tempfile::TempDir;

// Links the library, whose functions are declared below.
use skep as _;

const ERR_PANIC: i32 = -7;
/// Largest side of an image.
const MAX_SIDE: u32 = 32_768;
/// Bytes of a buffer, at most.
const MAX_BYTES: u128 = 1 << 16;

#[repr(C)]
struct Image {
    data: *const c_void,
    width: u32,
    height: u32,
    stride_bytes: usize,
    format: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
struct Camera {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    rotation: [f64; 9],
    translation: [f64; 3],
}

#[repr(C)]
struct FusionView {
    camera: *const Camera,
    width: u32,
    height: u32,
    depth: *const f32,
    depth_stride_bytes: usize,
    normal: *const f32,
    normal_stride_bytes: usize,
    image: *const Image,
    overlap: *const u32,
    overlap_count: usize,
    confidence: *const f32,
    confidence_stride_bytes: usize,
}

/// An object of the library.
type Object = *mut c_void;

unsafe extern "C" {
    fn skep_last_error(buffer: *mut c_char, capacity: usize) -> usize;
    fn skep_options_create(preset: *const c_char, out: *mut Object) -> i32;
    fn skep_options_destroy(options: Object);
    fn skep_options_set_text(options: Object, name: *const c_char, value: *const c_char) -> i32;
    fn skep_options_get_text(
        options: Object,
        name: *const c_char,
        buffer: *mut c_char,
        capacity: usize,
        needed: *mut usize,
    ) -> i32;
    fn skep_scene_create(out: *mut Object) -> i32;
    fn skep_scene_destroy(scene: Object);
    fn skep_scene_add_view(
        scene: Object,
        name: *const c_char,
        image: *const Image,
        camera: *const Camera,
        view: *mut u32,
    ) -> i32;
    fn skep_scene_set_mask(scene: Object, view: u32, mask: *const u8, stride: usize) -> i32;
    fn skep_scene_set_depth_range(scene: Object, view: u32, near: f64, far: f64) -> i32;
    fn skep_scene_set_sources(scene: Object, view: u32, sources: *const u32, count: usize) -> i32;
    fn skep_scene_add_points(
        scene: Object,
        positions: *const f64,
        count: usize,
        view_counts: *const u32,
        views: *const u32,
        view_total: usize,
    ) -> i32;
    fn skep_scene_validate(scene: Object) -> i32;
    fn skep_scene_get_sources(
        scene: Object,
        options: Object,
        view: u32,
        sources: *mut u32,
        capacity: usize,
        count: *mut usize,
    ) -> i32;
    fn skep_stepper_create(scene: Object, options: Object, out: *mut Object) -> i32;
    fn skep_stepper_destroy(stepper: Object);
    fn skep_packed_image_create(image: *const Image, out: *mut Object) -> i32;
    fn skep_packed_image_destroy(image: Object);
    fn skep_ncc_window_create(radius: u32, step: u32, a: f64, b: f64, c: f64, out: *mut Object) -> i32;
    fn skep_ncc_window_destroy(window: Object);
    fn skep_patch_ncc(
        window: Object,
        reference: Object,
        source: Object,
        pixels: *const u32,
        homographies: *const f64,
        count: usize,
        ncc: *mut f32,
    ) -> i32;
    fn skep_fuse(
        views: *const FusionView,
        count: usize,
        options: Object,
        progress: *const c_void,
        user: *mut c_void,
        cloud: *mut Object,
    ) -> i32;
    fn skep_cloud_destroy(cloud: Object);
    fn skep_write_depth_map(
        file: *const c_char,
        depth: *const f32,
        width: u32,
        height: u32,
        stride: usize,
    ) -> i32;
    fn skep_write_normal_map(
        file: *const c_char,
        normal: *const f32,
        width: u32,
        height: u32,
        stride: usize,
    ) -> i32;
    fn skep_write_consistency_graph(
        file: *const c_char,
        width: u32,
        height: u32,
        counts: *const u32,
        views: *const u32,
        total: usize,
    ) -> i32;
    fn skep_read_depth_map(
        file: *const c_char,
        depth: *mut f32,
        capacity: usize,
        width: *mut u32,
        height: *mut u32,
    ) -> i32;
    fn skep_read_normal_map(
        file: *const c_char,
        normal: *mut f32,
        capacity: usize,
        width: *mut u32,
        height: *mut u32,
    ) -> i32;
    fn skep_read_consistency_graph(
        file: *const c_char,
        counts: *mut u32,
        count_capacity: usize,
        views: *mut u32,
        view_capacity: usize,
        width: *mut u32,
        height: *mut u32,
        total: *mut usize,
    ) -> i32;
}

/// Any status but a panic; the error text is copied into a short buffer.
fn checked(status: i32) -> bool {
    let mut text = Buffer::new(9, &[]);
    // SAFETY: the buffer has nine bytes.
    unsafe { skep_last_error(text.pointer_mut().cast(), 9) };
    assert_ne!(status, ERR_PANIC, "a panic reached the C ABI");
    status == 0
}

/// Memory that ends at a page which cannot be touched.
struct Buffer {
    map: *mut u8,
    mapped: usize,
    start: *mut u8,
    length: usize,
}

const PAGE: usize = 4096;

#[cfg(target_os = "linux")]
mod pages {
    use std::ffi::{c_int, c_void};

    unsafe extern "C" {
        pub fn mmap(
            at: *mut c_void,
            length: usize,
            protection: c_int,
            flags: c_int,
            file: c_int,
            offset: i64,
        ) -> *mut c_void;
        pub fn mprotect(at: *mut c_void, length: usize, protection: c_int) -> c_int;
        pub fn munmap(at: *mut c_void, length: usize) -> c_int;
    }
    pub const READ_WRITE: c_int = 3;
    pub const PRIVATE_ANONYMOUS: c_int = 0x22;
}

impl Buffer {
    /// `length` bytes that repeat a pattern.
    fn new(length: usize, pattern: &[u8]) -> Buffer {
        let mapped = length.next_multiple_of(PAGE) + PAGE;
        // SAFETY: a new mapping; its last page is made inaccessible.
        let map: *mut u8 = unsafe {
            let map = pages::mmap(null_mut(), mapped, pages::READ_WRITE, pages::PRIVATE_ANONYMOUS, -1, 0);
            assert_ne!(map as isize, -1, "no memory");
            let map = map.cast::<u8>();
            assert_eq!(pages::mprotect(map.add(mapped - PAGE).cast(), PAGE, 0), 0);
            map
        };
        // SAFETY: within the mapping.
        let start = unsafe { map.add(mapped - PAGE - length) };
        for (index, byte) in
            pattern.iter().cycle().take(if pattern.is_empty() { 0 } else { length }).enumerate()
        {
            // SAFETY: the buffer has `length` bytes.
            unsafe { start.add(index).write(*byte) };
        }
        Buffer { map, mapped, start, length }
    }

    fn pointer<T>(&self) -> *const T {
        self.start.cast()
    }

    fn pointer_mut(&mut self) -> *mut u8 {
        self.start
    }

    fn of_numbers(numbers: &[f64]) -> Buffer {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_ne_bytes()).collect();
        Buffer::new(bytes.len(), &bytes)
    }

    fn of_indices(numbers: &[u32]) -> Buffer {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_ne_bytes()).collect();
        Buffer::new(bytes.len(), &bytes)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        assert!(self.length < self.mapped);
        // SAFETY: mapped in `new`, and not used any more.
        unsafe { pages::munmap(self.map.cast(), self.mapped) };
    }
}

/// Arguments that are made of the input; zeros after its end.
struct Arguments<'a>(&'a [u8]);

impl Arguments<'_> {
    fn byte(&mut self) -> u8 {
        match self.0.split_first() {
            Some((byte, rest)) => {
                self.0 = rest;
                *byte
            }
            None => 0,
        }
    }

    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.byte())
    }

    /// A side of an image: mostly small, else around the limits.
    fn side(&mut self) -> u32 {
        match self.byte() {
            255 => u32::MAX,
            254 => MAX_SIDE + 1,
            253 => MAX_SIDE,
            252 => u32::from_le_bytes(self.bytes()),
            byte => u32::from(byte % 40),
        }
    }

    fn index(&mut self) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(self.bytes()),
            byte => u32::from(byte % 6),
        }
    }

    /// A number: usual ones, those at the limits, and any.
    fn number(&mut self) -> f64 {
        match self.byte() {
            byte @ 0..=199 => f64::from(byte) / 8.0 - 8.0,
            byte @ 200..=250 => {
                let limits = [0.0, -0.0, 1.0, 1e-3, 1e9, 1e18, -1e18, 1e300, 5e-324, f64::MAX];
                let others = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
                limits.into_iter().chain(others).cycle().nth(usize::from(byte - 200)).unwrap_or(0.0)
            }
            _ => f64::from_le_bytes(self.bytes()),
        }
    }

    /// Rows of a height, with a stride that may be too small. `None` where the library would have to read
    /// more than a buffer of this program.
    fn rows(&mut self, row_bytes: u128, height: u32, is_refused: bool) -> Option<(Buffer, usize)> {
        let row = usize::try_from(row_bytes).unwrap_or(usize::MAX);
        let stride = match self.byte() {
            255 => usize::MAX,
            254 => 0,
            253 => row.saturating_sub(1),
            252 => usize::MAX / (height as usize).max(1),
            251 => (isize::MAX as usize / (height as usize).max(1)).saturating_add(1),
            byte => row.saturating_add(usize::from(byte % 8)),
        };
        let pattern: [u8; 12] = self.bytes();
        let needed = u128::from(height.saturating_sub(1)) * stride as u128 + row_bytes;
        if needed <= MAX_BYTES {
            return Some((Buffer::new(needed as usize, &pattern), stride));
        }
        let must_refuse = is_refused
            || stride < row
            || stride.checked_mul(height as usize).is_none_or(|bytes| bytes > isize::MAX as usize);
        must_refuse.then(|| (Buffer::new(1, &pattern), stride))
    }

    fn image(&mut self) -> Option<(Image, Buffer)> {
        let (width, height) = (self.side(), self.side());
        let format = match self.byte() {
            255 => u32::from_le_bytes(self.bytes()),
            byte => [0, 16, 32][usize::from(byte / 5 % 3)] + u32::from(byte % 5),
        };
        let channels = [1, 3, 3, 4, 4].get(format as usize % 16);
        let bytes = [1, 2, 4].get(format as usize / 16);
        let is_refused = channels.is_none() || bytes.is_none() || is_no_size(width, height);
        let pixel = channels.unwrap_or(&1) * bytes.unwrap_or(&1);
        let (buffer, stride_bytes) = self.rows(pixel * u128::from(width), height, is_refused)?;
        let data = if self.byte() == 255 { null() } else { buffer.pointer() };
        Some((Image { data, width, height, stride_bytes, format }, buffer))
    }

    fn camera(&mut self) -> Camera {
        let mut camera = Camera {
            fx: 20.0,
            fy: 20.0,
            cx: 10.0,
            cy: 8.0,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [-f64::from(self.byte() % 8) / 8.0, 0.0, 0.0],
        };
        match self.byte() {
            200 => camera.fx = self.number(),
            201 => camera.fy = self.number(),
            202 => camera.cx = self.number(),
            203 => camera.cy = self.number(),
            204 => camera.rotation[usize::from(self.byte() % 9)] = self.number(),
            205 => camera.translation[usize::from(self.byte() % 3)] = self.number(),
            _ => (),
        }
        camera
    }
}

fn is_no_size(width: u32, height: u32) -> bool {
    [width, height].iter().any(|side| !(1..=MAX_SIDE).contains(side))
}

/// Pictures, masks, points, lists, maps and texts in buffers.
pub fn pixels_and_arrays(input: &[u8]) -> bool {
    let mut arguments = Arguments(input);
    let (mut scene, mut options) = (null_mut(), null_mut());
    // SAFETY: out-pointers to variables.
    unsafe {
        assert!(checked(skep_scene_create(&mut scene)));
        assert!(checked(skep_options_create(null(), &mut options)));
    }
    let mut sizes = Vec::new();
    let mut calls = 0;
    while !arguments.0.is_empty() && calls < 32 {
        calls += 1;
        let _ = call(&mut arguments, scene, options, &mut sizes);
    }
    let mut stepper = null_mut();
    // SAFETY: objects of the library; they are destroyed once.
    unsafe {
        if checked(skep_scene_validate(scene)) && checked(skep_stepper_create(scene, options, &mut stepper)) {
            skep_stepper_destroy(stepper);
        }
        skep_options_destroy(options);
        skep_scene_destroy(scene);
    }
    // Most inputs have calls that are refused.
    calls > 0
}

/// One call; `None` where its buffers would be too large.
fn call(
    arguments: &mut Arguments,
    scene: Object,
    options: Object,
    sizes: &mut Vec<(u32, u32)>,
) -> Option<()> {
    let action = arguments.byte() % 10;
    // SAFETY: pointers are NULL or to buffers of the sizes that the arguments say, and objects are alive.
    unsafe {
        match action {
            0 | 1 => {
                let (image, _buffer) = arguments.image()?;
                let camera = arguments.camera();
                let mut view = 7;
                let out = if arguments.byte() == 255 { null_mut() } else { &mut view };
                if checked(skep_scene_add_view(scene, null(), &image, &camera, out)) {
                    sizes.push((image.width, image.height));
                }
            }
            2 => {
                let view = arguments.index();
                let size = sizes.get(view as usize).copied();
                let (width, height) = size.unwrap_or((4, 4));
                let (mask, stride) = arguments.rows(width.into(), height, size.is_none())?;
                checked(skep_scene_set_mask(scene, view, mask.pointer(), stride));
            }
            3 => {
                let view = arguments.index();
                let list: Vec<u32> = (0..arguments.byte() % 5).map(|_| arguments.index()).collect();
                let buffer = Buffer::of_indices(&list);
                let pointer = if list.is_empty() { null() } else { buffer.pointer() };
                checked(skep_scene_set_sources(scene, view, pointer, list.len()));
                let (near, far) = (arguments.number(), arguments.number());
                checked(skep_scene_set_depth_range(scene, view, near, far));
            }
            4 => {
                let count = usize::from(arguments.byte() % 5);
                let positions: Vec<f64> = (0..3 * count).map(|_| arguments.number()).collect();
                let counts: Vec<u32> = (0..count).map(|_| arguments.index()).collect();
                let views: Vec<u32> = (0..arguments.byte() % 9).map(|_| arguments.index()).collect();
                let positions = Buffer::of_numbers(&positions);
                let (counts, list) = (Buffer::of_indices(&counts), Buffer::of_indices(&views));
                let (positions, counts, list) = (positions.pointer(), counts.pointer(), list.pointer());
                checked(skep_scene_add_points(scene, positions, count, counts, list, views.len()));
            }
            5 => {
                let (view, capacity) = (arguments.index(), usize::from(arguments.byte() % 5));
                let mut buffer = Buffer::new(4 * capacity, &[]);
                let mut count = 0;
                let sources = buffer.pointer_mut().cast();
                checked(skep_scene_get_sources(scene, options, view, sources, capacity, &mut count));
            }
            6 => {
                let (image, _buffer) = arguments.image()?;
                ncc(arguments, &image);
            }
            7 => fuse(arguments, options)?,
            8 => texts(arguments, options),
            _ => write_maps(arguments)?,
        }
    }
    Some(())
}

/// # Safety
/// The image is what its fields say.
unsafe fn ncc(arguments: &mut Arguments, image: &Image) {
    let (mut packed, mut window) = (null_mut(), null_mut());
    let (radius, step) = (arguments.side() % 20, arguments.side() % 10);
    let (spatial, color, variance) = (arguments.number(), arguments.number(), arguments.number());
    let count = usize::from(arguments.byte() % 4);
    let pixels: Vec<u32> = (0..2 * count).map(|_| arguments.side()).collect();
    let matrices: Vec<f64> = (0..9 * count).map(|_| arguments.number()).collect();
    let (pixels, matrices) = (Buffer::of_indices(&pixels), Buffer::of_numbers(&matrices));
    let mut found = Buffer::new(4 * count, &[]);
    // SAFETY: as above; objects are destroyed once, NULL is ignored.
    unsafe {
        if checked(skep_packed_image_create(image, &mut packed))
            && checked(skep_ncc_window_create(radius, step, spatial, color, variance, &mut window))
        {
            let (pixels, matrices) = (pixels.pointer(), matrices.pointer());
            let found = found.pointer_mut().cast();
            checked(skep_patch_ncc(window, packed, packed, pixels, matrices, count, found));
        }
        skep_packed_image_destroy(packed);
        skep_ncc_window_destroy(window);
    }
}

fn fuse(arguments: &mut Arguments, options: Object) -> Option<()> {
    let count = usize::from(arguments.byte() % 4);
    let mut cameras = Vec::new();
    let mut buffers = Vec::new();
    let mut views = Vec::new();
    for _ in 0..count {
        let (width, height) = (arguments.side(), arguments.side());
        let is_refused = is_no_size(width, height);
        let (depth, depth_stride) = arguments.rows(4 * u128::from(width), height, is_refused)?;
        let (normal, normal_stride) = arguments.rows(12 * u128::from(width), height, is_refused)?;
        let (confidence, confidence_stride) = arguments.rows(4 * u128::from(width), height, is_refused)?;
        let overlap: Vec<u32> = (0..arguments.byte() % 4).map(|_| arguments.index()).collect();
        let list = Buffer::of_indices(&overlap);
        cameras.push(Box::new(arguments.camera()));
        let has_confidence = arguments.byte().is_multiple_of(2);
        views.push(FusionView {
            camera: &**cameras.last()?,
            width,
            height,
            depth: depth.pointer(),
            depth_stride_bytes: depth_stride,
            normal: normal.pointer(),
            normal_stride_bytes: normal_stride,
            image: null(),
            overlap: list.pointer(),
            overlap_count: overlap.len(),
            confidence: if has_confidence { confidence.pointer() } else { null() },
            confidence_stride_bytes: confidence_stride,
        });
        buffers.extend([depth, normal, confidence, list]);
    }
    let mut cloud = null_mut();
    // SAFETY: views, cameras and buffers live until here, and the cloud is destroyed once.
    unsafe {
        checked(skep_fuse(views.as_ptr(), count, options, null(), null_mut(), &mut cloud));
        skep_cloud_destroy(cloud);
    }
    Some(())
}

/// Sets an option of the groups that need no files, and gets it into a short buffer.
fn texts(arguments: &mut Arguments, options: Object) {
    let names: [&CStr; 6] = [
        c"schedule.scales",
        c"window.window_radius",
        c"input.bounds",
        c"fusion.voxel_size",
        c"simd",
        c"output.write",
    ];
    let name = names[usize::from(arguments.byte()) % names.len()];
    let length = usize::from(arguments.byte() % 64).min(arguments.0.len());
    let (text, rest) = arguments.0.split_at(length);
    arguments.0 = rest;
    let text: Vec<u8> = text.iter().copied().take_while(|&byte| byte != 0).collect();
    let text = Buffer::new(text.len() + 1, &[&text[..], &[0]].concat());
    let capacity = usize::from(arguments.byte() % 32);
    let mut buffer = Buffer::new(capacity, &[]);
    let mut needed = 0;
    // SAFETY: texts end with NUL, and the buffer has its capacity.
    unsafe {
        checked(skep_options_set_text(options, name.as_ptr(), text.pointer()));
        let place = buffer.pointer_mut().cast();
        checked(skep_options_get_text(options, name.as_ptr(), place, capacity, &mut needed));
    }
}

thread_local! {
    static FOLDER: TempDir = new_folder();
}

/// The path of a temporary file for C.
fn path() -> CString {
    let path = FOLDER.with(|folder| folder.path().join("map.bin"));
    CString::new(path.as_os_str().as_bytes()).expect("a path without NUL")
}

fn write_maps(arguments: &mut Arguments) -> Option<()> {
    let (width, height) = (arguments.side(), arguments.side());
    let is_refused = is_no_size(width, height);
    let (depth, depth_stride) = arguments.rows(4 * u128::from(width), height, is_refused)?;
    let (normal, normal_stride) = arguments.rows(12 * u128::from(width), height, is_refused)?;
    let file = path();
    // SAFETY: the buffers have rows of these sizes.
    unsafe {
        checked(skep_write_depth_map(file.as_ptr(), depth.pointer(), width, height, depth_stride));
        checked(skep_write_normal_map(file.as_ptr(), normal.pointer(), width, height, normal_stride));
    }
    if u128::from(width) * u128::from(height) <= MAX_BYTES / 4 {
        let counts: Vec<u32> = (0..width * height).map(|_| arguments.index()).collect();
        let views: Vec<u32> = (0..arguments.byte() % 9).map(|_| arguments.index()).collect();
        let (counts, list) = (Buffer::of_indices(&counts), Buffer::of_indices(&views));
        let (counts, list) = (counts.pointer(), list.pointer());
        // SAFETY: as above.
        unsafe {
            checked(skep_write_consistency_graph(file.as_ptr(), width, height, counts, list, views.len()))
        };
    }
    Some(())
}

/// Maps that are read into buffers: the kind, two capacities, and the file.
pub fn files(input: &[u8]) -> bool {
    let Some((&[kind, room, views], content)) = input.split_first_chunk::<3>() else { return false };
    FOLDER.with(|folder| write(&folder.path().join("map.bin"), content));
    let file = path();
    let (capacity, view_capacity) = (usize::from(room), usize::from(views));
    let mut buffer = Buffer::new(4 * capacity, &[]);
    let mut list = Buffer::new(4 * view_capacity, &[]);
    let values = if room == 255 { null_mut() } else { buffer.pointer_mut() };
    let (mut width, mut height, mut total) = (0, 0, 0);
    // SAFETY: the buffers have their capacities.
    unsafe {
        let status = match kind {
            b'd' => skep_read_depth_map(file.as_ptr(), values.cast(), capacity, &mut width, &mut height),
            b'n' => skep_read_normal_map(file.as_ptr(), values.cast(), capacity, &mut width, &mut height),
            _ => skep_read_consistency_graph(
                file.as_ptr(),
                values.cast(),
                capacity,
                list.pointer_mut().cast(),
                view_capacity,
                &mut width,
                &mut height,
                &mut total,
            ),
        };
        checked(status)
    }
}
