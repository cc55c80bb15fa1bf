// A target needs a source: this file is empty. tests/CMakeLists.txt lists the headers that are parsed once.
