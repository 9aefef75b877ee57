"""Any insertion algorithm held to the contract of a corrector: doors to what it is made of, streams, one judge."""
