// A target needs a source: this file is empty. offline/CMakeLists.txt lists the headers that are parsed once.
