"""Planning with a policy, by games on the whole instance and on its regions."""
