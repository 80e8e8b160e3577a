# Archives by Zig, whose program has the archiver as a command. CMake includes this after its rules
# for the platform, which would win over definitions on the command line.
set(CMAKE_CXX_ARCHIVE_CREATE "<CMAKE_AR> ar qc <TARGET> <OBJECTS>")
set(CMAKE_CXX_ARCHIVE_FINISH "<CMAKE_AR> ranlib <TARGET>")
