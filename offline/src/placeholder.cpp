namespace alces {}
