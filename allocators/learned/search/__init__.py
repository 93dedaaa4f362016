"""From a policy to a plan: games on the whole instance and on its regions."""
