# The system's libraries that libskep.a needs, as the linker wants them ordered. They are what
#   cargo rustc --release --lib --crate-type staticlib -- --print native-static-libs
# says, each once, less what every C compiler links by itself (c and gcc_s; with the latter named, nothing could be
# linked with -static).
if(APPLE OR WIN32)
    set(skep_native_libraries)
else()
    set(skep_native_libraries util rt pthread m dl)
endif()
